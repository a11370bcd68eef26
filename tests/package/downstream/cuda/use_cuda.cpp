// gart::cuda from g++: its configurations are there, and a machine without a device says why.
#include <gart/exec/cuda.hpp>
#include <gart/runtime/session.hpp>

#include <cstdio>

int main() {
  std::string reason;
  std::size_t const devices = gart::cuda_devices(&reason).size();
  for (gart::configuration_info const& configuration : gart::compiled_configurations())
    if (configuration.backend == gart::backend_kind::cuda) {
      std::printf("cuda: %zu devices %s\n", devices, reason.c_str());
      return devices > 0 || !reason.empty() ? 0 : 1;
    }
  return 1;
}
