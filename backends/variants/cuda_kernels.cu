// The CUDA policy's variants: kernels.
#include <gart/exec/cuda_launch.cuh>

#include "variant_rows.hpp"

namespace {
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_ROWS(gart_cuda_kernels, gart::register_kernel_variants<gart::cuda_exec>(device_available))
