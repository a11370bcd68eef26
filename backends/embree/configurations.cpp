// The OpenMP policy with Embree.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/embree_tracer.hpp>

namespace {
using tracer = gart::embree_tracer<gart::openmp_exec>;
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_embree_configurations, gart::register_methods<gart::openmp_exec, tracer>(13))
