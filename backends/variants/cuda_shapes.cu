// The CUDA policy's variants: shapes.
#include <gart/exec/cuda_launch.cuh>

#include "variant_configurations.hpp"

namespace {
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_cuda_shapes, gart::register_shape_variants<gart::cuda_exec>(device_available))
