// gart::gart alone: a scan on each host policy, compiled here.
#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/core/version.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/parallel.hpp>

#include <cstdio>
#include <vector>

template <class E>
bool scans() {
  E exec;
  gart::buffer<gart::u32, E> in(exec, std::vector<gart::u32>{3, 1, 4}), out(exec, 3), total(exec, 1);
  exclusive_scan(exec, gart::span<gart::u32 const>(in), out.view(), total.view());
  return out.to_host() == std::vector<gart::u32>{0, 3, 4} && total.front() == 8;
}

int main() {
  std::printf("version %s\n", gart::version);
  return scans<gart::serial_exec>() && scans<gart::openmp_exec>() ? 0 : 1;
}
