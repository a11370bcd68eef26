// The OpenMP policy's variants: shapes.
#include "variant_rows.hpp"

#include <gart/exec/parallel.hpp>

GART_REGISTER_ROWS(gart_openmp_shapes, gart::register_shape_variants<gart::openmp_exec>())
