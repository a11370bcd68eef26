// The OpenMP policy with tile lists, and gradients of depth.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {
using tracer = gart::tile_tracer<gart::openmp_exec>;
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_openmp_depth_configurations, gart::register_depth<gart::openmp_exec, tracer>(16))
