// The CUDA policy with tile lists.
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {
using tracer = gart::tile_tracer<gart::cuda_exec>;
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_CONFIGURATIONS(
    gart_cuda_tile_configurations,
    gart::register_configurations<gart::cuda_exec, tracer, gart::pixel_strategy>(30, device_available);
    gart::register_configurations<gart::cuda_exec, tracer, gart::cleared_strategy>(29, device_available);
    gart::register_configurations<gart::cuda_exec, tracer, gart::hybrid_strategy>(31, device_available);
    gart::register_configurations<gart::cuda_exec, tracer, gart::deterministic_strategy>(32, device_available);
    gart::register_configurations<gart::cuda_exec, tracer, gart::primitive_strategy>(33, device_available))
