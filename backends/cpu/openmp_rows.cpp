// The OpenMP policy with gart's own BVH.
#include <gart/exec/parallel.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/train/compiled_rows.hpp>

GART_REGISTER_ROWS(gart_openmp_rows,
                   gart::register_rows<gart::openmp_exec, gart::bvh_tracer<gart::openmp_exec>, gart::pixel_strategy>(10))
