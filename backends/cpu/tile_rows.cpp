// The OpenMP policy with tile lists.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_rows.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {
using tracer = gart::tile_tracer<gart::openmp_exec>;
}  // namespace

GART_REGISTER_ROWS(gart_openmp_tile_rows, gart::register_rows<gart::openmp_exec, tracer, gart::pixel_strategy>(16);
                   gart::register_rows<gart::openmp_exec, tracer, gart::hybrid_strategy>(17);
                   gart::register_rows<gart::openmp_exec, tracer, gart::primitive_strategy>(18))
