// The CUDA policy with tile lists, and gradients of depth.
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {
using tracer = gart::tile_tracer<gart::cuda_exec>;
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_cuda_depth_configurations,
                             gart::register_depth<gart::cuda_exec, tracer>(20, device_available))
