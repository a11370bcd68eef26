// The CUDA policy with tile lists.
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {
using tracer = gart::tile_tracer<gart::cuda_exec>;
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_cuda_tile_configurations,
                             gart::register_methods<gart::cuda_exec, tracer>(29, device_available))
