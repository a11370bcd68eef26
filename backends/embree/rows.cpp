// The host policies with Embree.
#include <gart/exec/parallel.hpp>
#include <gart/trace/embree_tracer.hpp>
#include <gart/train/compiled_rows.hpp>

GART_REGISTER_ROWS(
    gart_embree_rows,
    gart::register_rows<gart::serial_exec, gart::embree_tracer<gart::serial_exec>, gart::pixel_strategy>(1);
    gart::register_rows<gart::openmp_exec, gart::embree_tracer<gart::openmp_exec>, gart::pixel_strategy>(11))
