// The OpenMP policy's variants: kernels.
#include "variant_configurations.hpp"

#include <gart/exec/parallel.hpp>

GART_REGISTER_CONFIGURATIONS(gart_openmp_kernels, gart::register_kernel_variants<gart::openmp_exec>())
