// The CUDA policy's variants.
#include <gart/exec/cuda_launch.cuh>

#include "variant_configurations.hpp"

namespace {
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_cuda_variants, gart::register_variants<gart::cuda_exec>(device_available))
