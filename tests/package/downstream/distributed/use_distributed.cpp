// gart::distributed: ranks, of which there is one here, and configurations for several.
#include <gart/comm/mpi_comm.hpp>
#include <gart/runtime/session.hpp>

#include <cstdio>

int main() {
  gart::mpi_comm const ranks;
  for (gart::configuration_info const& configuration : gart::compiled_configurations())
    if (configuration.ranks) return std::printf("distributed, %d rank\n", ranks.size()), ranks.size() != 1;
  return 1;
}
