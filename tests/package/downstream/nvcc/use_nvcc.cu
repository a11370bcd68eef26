// A kernel of one's own on cuda_exec, compiled by nvcc; run where there is a device.
#include <gart/exec/buffer.hpp>
#include <gart/exec/cuda_launch.cuh>

#include <vector>

struct square {
  gart::span<gart::u32> values;
  __device__ void operator()(gart::index_t i) const { values[i] *= values[i]; }
};

int main() {
  if (gart::cuda_devices().empty()) return 0;
  gart::cuda_exec exec;
  gart::buffer<gart::u32, gart::cuda_exec> values(exec, std::vector<gart::u32>{1, 2, 3});
  parallel_for(exec, "square", 3, square{values});
  return values.to_host() == std::vector<gart::u32>{1, 4, 9} ? 0 : 1;
}
