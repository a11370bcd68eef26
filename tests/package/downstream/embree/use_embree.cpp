// gart::embree: its configurations are there.
#include <gart/runtime/session.hpp>

#include <cstdio>

int main() {
  for (gart::configuration_info const& configuration : gart::compiled_configurations())
    if (configuration.tracer == gart::tracer_kind::embree)
      return std::printf("%s on %s\n", to_string(configuration.tracer), to_string(configuration.backend)), 0;
  return 1;
}
