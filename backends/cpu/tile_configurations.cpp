// The OpenMP policy with tile lists.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {
using tracer = gart::tile_tracer<gart::openmp_exec>;
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_openmp_tile_configurations,
                             gart::register_configurations<gart::openmp_exec, tracer, gart::pixel_strategy>(16);
                             gart::register_configurations<gart::openmp_exec, tracer, gart::hybrid_strategy>(17);
                             gart::register_configurations<gart::openmp_exec, tracer, gart::primitive_strategy>(18))
