// The serial policy with gart's own BVH.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_rows.hpp>
#include <gart/trace/bvh_tracer.hpp>

namespace {
using tracer = gart::bvh_tracer<gart::serial_exec>;
}  // namespace

GART_REGISTER_ROWS(gart_serial_rows, gart::register_rows<gart::serial_exec, tracer, gart::pixel_strategy>(0);
                   gart::register_rows<gart::serial_exec, tracer, gart::hybrid_strategy>(1);
                   gart::register_rows<gart::serial_exec, tracer, gart::primitive_strategy>(2))
