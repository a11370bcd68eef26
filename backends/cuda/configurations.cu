// The CUDA policy with gart's own BVH.
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/bvh_tracer.hpp>

namespace {
using tracer = gart::bvh_tracer<gart::cuda_exec>;
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_CONFIGURATIONS(
    gart_cuda_configurations,
    gart::register_configurations<gart::cuda_exec, tracer, gart::pixel_strategy>(20, device_available);
    gart::register_configurations<gart::cuda_exec, tracer, gart::hybrid_strategy>(21, device_available);
    gart::register_configurations<gart::cuda_exec, tracer, gart::primitive_strategy>(23, device_available);
    gart::register_configurations<gart::cuda_exec, tracer, gart::deterministic_strategy>(22, device_available))
