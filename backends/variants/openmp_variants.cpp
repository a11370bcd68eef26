// The OpenMP policy's variants, and sums in a fixed order, which are among the ordinary configurations of a device.
#include "variant_configurations.hpp"

#include <gart/exec/parallel.hpp>

GART_REGISTER_CONFIGURATIONS(gart_openmp_variants, gart::register_variants<gart::openmp_exec>();
                             gart::register_variant<gart::openmp_exec, gart::generalized_gaussian<>,
                                                    gart::deterministic_method>(gart::always_available))
