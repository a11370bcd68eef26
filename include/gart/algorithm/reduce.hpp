#pragma once
/// \file
/// One number of many: out[0] = the sum, minimum or maximum of in[0..n).
///
/// in: n of float, double, u32 or u64. out: one element of the policy's memory. Sums of float are formed in double and
/// rounded once; integers wrap. The order of additions depends on n alone, never on threads. So a policy gives the same
/// bits at every run (CUDA: on the same device). n = 0 gives the neutral element: 0, or the largest or the lowest value
/// (infinities for floating point). The minimum and maximum of NaN are unspecified.
/// Cost: reads `in` once. Errors: invalid_argument where `out` is empty.

#include <gart/algorithm/exclusive_scan.hpp>

#include <limits>

namespace gart {

/// What a reduction computes of the elements: their sum, minimum or maximum.
enum class reduction { sum, min, max };

/// The numbers that can be reduced.
template <class T>
concept reducible = std::same_as<T, float> || std::same_as<T, double> || std::same_as<T, u32> || std::same_as<T, u64>;

/// Compiled into gart::cuda.
template <reducible T>
void reduce(cuda_exec& exec, span<std::type_identity_t<T> const> in, span<T> out, reduction op = reduction::sum);

}  // namespace gart

namespace gart { inline namespace GART_ISA {

namespace detail {

template <class T>
using sum_of = std::conditional_t<std::is_same_v<T, float>, double, T>;

struct add {
  template <class T>
  GART_HD T operator()(T a, T b) const {
    return a + b;
  }
};
struct lesser {
  template <class T>
  GART_HD T operator()(T a, T b) const {
    return b < a ? b : a;
  }
};
struct greater {
  template <class T>
  GART_HD T operator()(T a, T b) const {
    return a < b ? b : a;
  }
};

template <class T>
constexpr T neutral_of_min() {
  return std::numeric_limits<T>::has_infinity ? std::numeric_limits<T>::infinity() : std::numeric_limits<T>::max();
}
template <class T>
constexpr T neutral_of_max() {
  return std::numeric_limits<T>::has_infinity ? -std::numeric_limits<T>::infinity() : std::numeric_limits<T>::lowest();
}

template <class A, class E, class T, class Op>
A host_reduce(E& exec, span<T const> in, A neutral, Op op) {
  // Runs of fixed length, folded in order: the sum is the same on any number of threads.
  constexpr std::size_t run = 4096;
  std::size_t const n = in.size(), runs = (n + run - 1) / run, blocks = host_blocks(exec, n);
  A* const partial = static_cast<A*>(exec.workspace(runs * sizeof(A)));
  for_blocks(exec, blocks, [=](std::size_t b) {
    for (std::size_t r = block_begin(runs, blocks, b); r < block_begin(runs, blocks, b + 1); ++r) {
      A value = neutral;
      for (std::size_t i = r * run; i < std::min(n, (r + 1) * run); ++i) value = op(value, static_cast<A>(in[i]));
      partial[r] = value;
    }
  });
  A value = neutral;
  for (std::size_t r = 0; r < runs; ++r) value = op(value, partial[r]);
  return value;
}

}  // namespace detail

/// On a host.
template <host_execution E, reducible T>
void reduce(E& exec, span<std::type_identity_t<T> const> in, span<T> out, reduction op = reduction::sum) {
  detail::require_size("reduce", "out", out.size(), 1);
  stage_scope scope(exec, "reduce");
  switch (op) {
    case reduction::sum:
      out[0] = static_cast<T>(detail::host_reduce(exec, in, detail::sum_of<T>{0}, detail::add{}));
      break;
    case reduction::min:
      out[0] = detail::host_reduce(exec, in, detail::neutral_of_min<T>(), detail::lesser{});
      break;
    case reduction::max:
      out[0] = detail::host_reduce(exec, in, detail::neutral_of_max<T>(), detail::greater{});
      break;
  }
}

}}  // namespace gart::GART_ISA
