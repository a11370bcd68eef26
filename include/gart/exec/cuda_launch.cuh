#pragma once
/// \file
/// parallel_for on cuda_exec: one thread an index, one block a tile. Needs nvcc. A kernel may name its launch bounds,
/// both or neither. `static constexpr int block_size` is the threads of a block of an index kernel, 256 by default. Of
/// a tile kernel it is the largest number of lanes, which lowers tile_range::lanes. `static constexpr int min_blocks`,
/// 1 by default, is the blocks whose registers a multiprocessor must hold.

#include <gart/exec/cuda.hpp>
#include <gart/exec/kept_address.hpp>
#include <gart/exec/stage.hpp>

#include <cuda_runtime.h>

#include <type_traits>

#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
#error "gart needs a GPU of compute capability 8.0 or later: set CMAKE_CUDA_ARCHITECTURES to 80 or more"
#endif

namespace gart { inline namespace GART_ISA {

namespace detail {

struct default_bounds {
  static constexpr int block_size = 256, min_blocks = 1;
};

// Kernels are aggregates, which a base with defaults would leave without their initialisers. One that names a bound
// must name both, so that one that is misspelt is found.
template <class K>
constexpr auto launch_bounds() {
  if constexpr (
      requires { K::block_size; } || requires { K::min_blocks; })
    return std::type_identity<K>{};
  else
    return std::type_identity<default_bounds>{};
}
template <class K>
using bounds_of = typename decltype(launch_bounds<K>())::type;

template <class Scratch>
class cuda_team {
 public:
  __device__ cuda_team(Scratch& scratch) : scratch_(scratch) {}
  __device__ index_t tile() const { return blockIdx.x; }
  __device__ Scratch& scratch() const { return scratch_; }
  __device__ void barrier() const { __syncthreads(); }
  template <class F>
  __device__ void for_each(index_t n, F&& f) const {
    for (index_t i = threadIdx.x; i < n; i += blockDim.x) f(i);
  }

 private:
  Scratch& scratch_;
};

template <class K>
__global__ void __launch_bounds__(bounds_of<K>::block_size, bounds_of<K>::min_blocks)
    run_index_kernel(index_t n, K const kernel) {
  u64 const i = u64{blockIdx.x} * bounds_of<K>::block_size + threadIdx.x;
  if (i < n) kernel(static_cast<index_t>(i));
}

template <class K>
__global__ void __launch_bounds__(bounds_of<K>::block_size, bounds_of<K>::min_blocks) run_tile_kernel(K const kernel) {
  static_assert(alignof(typename K::scratch) <= 16);
  extern __shared__ __align__(16) unsigned char memory[];
  cuda_team<typename K::scratch> team(kept_address<typename K::scratch>(memory));
  kernel(team);
}

}  // namespace detail

/// kernel(i) for i in [0, n).
template <index_kernel K>
void parallel_for(cuda_exec& exec, char const* label, index_t n, K const& kernel) {
  if (n == 0) return;
  stage_scope scope(exec, label);
  constexpr int block = detail::bounds_of<K>::block_size;
  exec.make_current();
  detail::run_index_kernel<K><<<(n - 1) / block + 1, block, 0, static_cast<cudaStream_t>(exec.stream())>>>(n, kernel);
  exec.check_launch(label);
}

/// kernel(team) for each tile.
template <tile_kernel K>
void parallel_for(cuda_exec& exec, char const* label, tile_range range, K const& kernel) {
  if (range.tiles == 0) return;
  stage_scope scope(exec, label);
  constexpr std::size_t bytes = sizeof(typename K::scratch);
  constexpr index_t max_lanes = detail::bounds_of<K>::block_size;
  exec.make_current();
  if constexpr (bytes > 48 * 1024)
    cudaFuncSetAttribute(detail::run_tile_kernel<K>, cudaFuncAttributeMaxDynamicSharedMemorySize,
                         static_cast<int>(bytes));
  index_t const lanes = range.lanes < max_lanes ? range.lanes : max_lanes;
  // clang-format off
  detail::run_tile_kernel<K><<<range.tiles, lanes, bytes, static_cast<cudaStream_t>(exec.stream())>>>(kernel);
  // clang-format on
  exec.check_launch(label);
}

}}  // namespace gart::GART_ISA
