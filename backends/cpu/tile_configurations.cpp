// The OpenMP policy with tile lists.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {
using tracer = gart::tile_tracer<gart::openmp_exec>;
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_openmp_tile_configurations, gart::register_methods<gart::openmp_exec, tracer>(16))
