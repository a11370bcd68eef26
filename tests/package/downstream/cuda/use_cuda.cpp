// gart::cuda from g++: its rows are there, and a machine without a device says why.
#include <gart/exec/cuda.hpp>
#include <gart/runtime/session.hpp>

#include <cstdio>

int main() {
  std::string reason;
  std::size_t const devices = gart::cuda_devices(&reason).size();
  for (gart::row_info const& row : gart::compiled_rows())
    if (row.backend == "cuda") {
      std::printf("cuda: %zu devices %s\n", devices, reason.c_str());
      return devices > 0 || !reason.empty() ? 0 : 1;
    }
  return 1;
}
