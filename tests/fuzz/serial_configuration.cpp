// The one configuration that checkpoint.cpp asks for: all of gart::cpu, instrumented, would take minutes to compile.

#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/bvh_tracer.hpp>

using serial_tracer = gart::bvh_tracer<gart::serial_exec>;

GART_REGISTER_CONFIGURATIONS(gart_fuzz_configuration,
                             gart::register_configuration_of<gart::serial_exec, gart::scene_traits<0>, serial_tracer,
                                                             gart::pixel_method>(0, gart::always_available))
