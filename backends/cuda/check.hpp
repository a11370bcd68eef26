#pragma once
// The CUDA runtime's error codes as gart's errors.

#include <gart/core/error.hpp>
#include <gart/core/isa.hpp>

#include <cuda_runtime.h>

#include <string>

namespace gart { inline namespace GART_ISA { namespace detail {

inline std::string describe(cudaError_t code) {
  return std::string(cudaGetErrorString(code)) + " (" + cudaGetErrorName(code) + ")";
}

// `what` says what was being done.
inline void check_cuda(cudaError_t code, char const* what) {
  if (code == cudaSuccess) return;
  cudaGetLastError();
  throw error(std::string("CUDA failed while ") + what + ": " + describe(code) +
              "; if a kernel before it failed, GART_CUDA_SYNC=1 in the environment names that kernel");
}

}}}  // namespace gart::GART_ISA::detail
