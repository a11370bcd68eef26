// The OpenMP policy with Embree.
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/embree_tracer.hpp>

namespace {
using tracer = gart::embree_tracer<gart::openmp_exec>;
}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_embree_configurations,
                             gart::register_configurations<gart::openmp_exec, tracer, gart::pixel_strategy>(13);
                             gart::register_configurations<gart::openmp_exec, tracer, gart::hybrid_strategy>(14);
                             gart::register_configurations<gart::openmp_exec, tracer, gart::primitive_strategy>(15))
