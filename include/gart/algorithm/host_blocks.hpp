#pragma once
/// \file
/// How the algorithms split an array over a host policy's threads: into contiguous blocks, one a thread, in any order.
/// What depends on the number of blocks must not reach a result.

#include <gart/core/isa.hpp>
#include <gart/exec/concepts.hpp>

#include <algorithm>
#include <cstddef>

namespace gart { inline namespace GART_ISA { namespace detail {

template <host_execution E>
std::size_t host_blocks(E& exec, std::size_t n) {
  // Below this a block costs less than waking a thread for it.
  constexpr std::size_t smallest = 16384;
  return std::clamp<std::size_t>(n / smallest, 1, static_cast<std::size_t>(exec.threads()));
}

inline std::size_t block_begin(std::size_t n, std::size_t blocks, std::size_t b) {
  return n / blocks * b + std::min(n % blocks, b);
}

template <host_execution E, class F>
void for_blocks([[maybe_unused]] E& exec, std::size_t blocks, F const& f) {
  if (blocks == 1) return f(std::size_t{0});
#if defined(_OPENMP)
#pragma omp parallel for schedule(static) num_threads(exec.threads())
#endif
  for (std::size_t b = 0; b < blocks; ++b) f(b);
}

}}}  // namespace gart::GART_ISA::detail
