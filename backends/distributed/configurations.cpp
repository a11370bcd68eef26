// The OpenMP policy with tile lists, on several ranks.
#include <gart/comm/mpi_comm.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

namespace {

using namespace gart;

template <gradient_method Method>
void register_on_ranks(int rank) {
  register_configurations<openmp_exec, tile_tracer<openmp_exec>, Method, mpi_comm>(rank);
}

}  // namespace

GART_REGISTER_CONFIGURATIONS(gart_rank_configurations, register_on_ranks<deterministic_method>(16),
                             register_on_ranks<primitive_method>(17),
                             register_on_ranks<with_depth<primitive_method>>(17))
