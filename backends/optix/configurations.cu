// The CUDA policy with OptiX: one configuration, which is never the automatic choice.
#include <gart/exec/cuda_launch.cuh>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/optix_tracer.hpp>

GART_REGISTER_CONFIGURATIONS(
    gart_optix_configurations,
    gart::register_configuration_of<gart::cuda_exec, gart::scene_traits<3>, gart::optix_tracer<gart::cuda_exec>,
                                    gart::pixel_method>(-3, gart::optix_available))
