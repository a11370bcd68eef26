// The CUDA policy with tile lists, on several ranks.
#include <gart/comm/nccl_comm.hpp>
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {

using namespace gart;

bool device_available(std::string* reason) { return !cuda_devices(reason).empty(); }

template <gradient_method Method>
void register_on_devices(int rank) {
  register_configurations<cuda_exec, tile_tracer<cuda_exec>, Method, nccl_comm>(rank, device_available);
}

}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_device_rank_configurations, register_on_devices<deterministic_method>(36),
                             register_on_devices<primitive_method>(37),
                             register_on_devices<with_depth<primitive_method>>(37))
