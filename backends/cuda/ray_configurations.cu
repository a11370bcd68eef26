// Batches of rays on the CUDA policy.
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_rays.hpp>

GART_REGISTER_CONFIGURATIONS(gart_cuda_rays, gart::register_rays<gart::cuda_exec>())
