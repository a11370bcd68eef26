// The OpenMP policy with gart's own BVH.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/bvh_tracer.hpp>

namespace {
using tracer = gart::bvh_tracer<gart::openmp_exec>;
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_openmp_configurations, gart::register_methods<gart::openmp_exec, tracer>(10))
