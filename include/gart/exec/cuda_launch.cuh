#pragma once
// parallel_for on cuda_exec: one thread an index, one block a tile. Needs nvcc.
// A kernel may name `static constexpr int block_size` (default 256: the threads of a block of an index kernel, the most
// lanes of a tile kernel, to which tile_range::lanes is lowered) and, for its registers, `static constexpr int
// min_blocks` (blocks a multiprocessor, default 1).

#include <gart/exec/cuda.hpp>
#include <gart/exec/kept_address.hpp>
#include <gart/exec/stage.hpp>

#include <cuda_runtime.h>

#if defined(__CUDA_ARCH__) && __CUDA_ARCH__ < 800
#error "gart needs a GPU of compute capability 8.0 or later: set CMAKE_CUDA_ARCHITECTURES to 80 or more"
#endif

namespace gart::inline GART_ISA {

namespace detail {

template <class K>
constexpr int block_size_of() {
  if constexpr (requires { K::block_size; })
    return K::block_size;
  else
    return 256;
}
template <class K>
constexpr int min_blocks_of() {
  if constexpr (requires { K::min_blocks; })
    return K::min_blocks;
  else
    return 1;
}

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
__global__ void __launch_bounds__(block_size_of<K>(), min_blocks_of<K>()) run_index_kernel(index_t n, K const kernel) {
  u64 const i = u64{blockIdx.x} * block_size_of<K>() + threadIdx.x;
  if (i < n) kernel(static_cast<index_t>(i));
}

template <class K>
__global__ void __launch_bounds__(block_size_of<K>(), min_blocks_of<K>()) run_tile_kernel(K const kernel) {
  static_assert(alignof(typename K::scratch) <= 16);
  extern __shared__ __align__(16) unsigned char memory[];
  cuda_team<typename K::scratch> team(kept_address<typename K::scratch>(memory));
  kernel(team);
}

}  // namespace detail

template <index_kernel K>
void parallel_for(cuda_exec& exec, char const* label, index_t n, K const& kernel) {
  if (n == 0) return;
  stage_scope scope(exec, label);
  constexpr int block = detail::block_size_of<K>();
  exec.make_current();
  detail::run_index_kernel<K><<<(n - 1) / block + 1, block, 0, static_cast<cudaStream_t>(exec.stream())>>>(n, kernel);
  exec.check_launch(label);
}

template <tile_kernel K>
void parallel_for(cuda_exec& exec, char const* label, tile_range range, K const& kernel) {
  if (range.tiles == 0) return;
  stage_scope scope(exec, label);
  constexpr std::size_t bytes = sizeof(typename K::scratch);
  constexpr index_t most = detail::block_size_of<K>();
  exec.make_current();
  if constexpr (bytes > 48 * 1024)
    cudaFuncSetAttribute(detail::run_tile_kernel<K>, cudaFuncAttributeMaxDynamicSharedMemorySize,
                         static_cast<int>(bytes));
  index_t const lanes = range.lanes < most ? range.lanes : most;
  // clang-format off
  detail::run_tile_kernel<K><<<range.tiles, lanes, bytes, static_cast<cudaStream_t>(exec.stream())>>>(kernel);
  // clang-format on
  exec.check_launch(label);
}

}  // namespace gart::inline GART_ISA
