// gart::embree: its configurations are there.
#include <gart/runtime/session.hpp>

#include <cstdio>

int main() {
  for (gart::configuration_info const& configuration : gart::compiled_configurations())
    if (configuration.tracer == "embree")
      return std::printf("%s on %s\n", configuration.tracer.c_str(), configuration.backend.c_str()), 0;
  return 1;
}
