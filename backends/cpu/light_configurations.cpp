// Paths of light on the host policies.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_paths.hpp>

GART_REGISTER_CONFIGURATIONS(gart_host_paths, gart::register_paths<gart::serial_exec>();
                             gart::register_paths<gart::openmp_exec>())
