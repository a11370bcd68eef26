// The serial policy with gart's own BVH.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/bvh_tracer.hpp>

namespace {
using tracer = gart::bvh_tracer<gart::serial_exec>;
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_serial_configurations, gart::register_methods<gart::serial_exec, tracer>(0))
