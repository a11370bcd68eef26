#pragma once
/// \file
/// Counts to offsets: out[i] = in[0] + ... + in[i - 1], and total[0] = the sum of all.
///
/// in: n counts. out: n offsets, T = u32 or u64; must not overlap `in`. total: one element of the policy's memory, or
/// empty. It may be the element after `out`: then `out` has the n + 1 offsets of a segmented array. Sums are formed in
/// T: take u64 unless the total is known to fit in 32 bits, as u32 wraps. n = 0 gives total 0; n may pass 2^32. Cost:
/// reads `in` twice (CUDA: once), writes `out` once. Errors: invalid_argument where a span is too short.

#include <gart/algorithm/host_blocks.hpp>
#include <gart/core/error.hpp>
#include <gart/core/span.hpp>
#include <gart/exec/stage.hpp>

#include <concepts>
#include <string>
#include <type_traits>

namespace gart {

class cuda_exec;

/// What sums are formed in.
template <class T>
concept scan_sum = std::same_as<T, u32> || std::same_as<T, u64>;

/// Compiled into gart::cuda.
template <scan_sum T>
void exclusive_scan(cuda_exec& exec, span<u32 const> in, span<T> out, span<std::type_identity_t<T>> total = {});

}  // namespace gart

namespace gart { inline namespace GART_ISA {

namespace detail {

inline void require_size(char const* algorithm, char const* field, std::size_t size, std::size_t needed) {
  if (size < needed)
    throw invalid_argument(std::string(algorithm) + ": `" + field + "` has " + std::to_string(size) +
                           " elements, needs " + std::to_string(needed) + "; resize its buffer before the call");
}

}  // namespace detail

/// On a host.
template <host_execution E, scan_sum T>
void exclusive_scan(E& exec, span<u32 const> in, span<T> out, span<std::type_identity_t<T>> total = {}) {
  detail::require_size("exclusive_scan", "out", out.size(), in.size());
  stage_scope scope(exec, "exclusive_scan");
  std::size_t const n = in.size(), blocks = detail::host_blocks(exec, n);
  T* const sums = static_cast<T*>(exec.workspace(blocks * sizeof(T)));
  if (blocks > 1)
    detail::for_blocks(exec, blocks, [=](std::size_t b) {
      T sum = 0;
      for (std::size_t i = detail::block_begin(n, blocks, b); i < detail::block_begin(n, blocks, b + 1); ++i)
        sum += in[i];
      sums[b] = sum;
    });
  else
    sums[0] = 0;
  T offset = 0;
  for (std::size_t b = 0; b < blocks; ++b) {
    T const sum = sums[b];
    sums[b] = offset;
    offset += sum;
  }
  detail::for_blocks(exec, blocks, [=](std::size_t b) {
    T sum = sums[b];
    for (std::size_t i = detail::block_begin(n, blocks, b); i < detail::block_begin(n, blocks, b + 1); ++i) {
      out[i] = sum;
      sum += in[i];
    }
    sums[b] = sum;
  });
  if (!total.empty()) total[0] = sums[blocks - 1];
}

}}  // namespace gart::GART_ISA
