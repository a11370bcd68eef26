// The CUDA policy with gart's own BVH.
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/bvh_tracer.hpp>

namespace {
using tracer = gart::bvh_tracer<gart::cuda_exec>;
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_cuda_configurations,
                             gart::register_methods<gart::cuda_exec, tracer>(20, device_available))
