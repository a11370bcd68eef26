// Batches of rays on the host policies.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_rays.hpp>

GART_REGISTER_CONFIGURATIONS(gart_host_rays, gart::register_rays<gart::serial_exec>();
                             gart::register_rays<gart::openmp_exec>())
