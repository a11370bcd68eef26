// The OpenMP policy's variants: kernels.
#include "variant_rows.hpp"

#include <gart/exec/parallel.hpp>

GART_REGISTER_ROWS(gart_openmp_kernels, gart::register_kernel_variants<gart::openmp_exec>())
