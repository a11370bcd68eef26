// Paths of light on the CUDA policy. Compiled without contraction, so that they are those of the hosts.
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_paths.hpp>

namespace {
bool device_available(std::string* reason) { return !gart::cuda_devices(reason).empty(); }
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_cuda_paths, gart::register_paths<gart::cuda_exec>(device_available))
