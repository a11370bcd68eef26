#include "threads.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>

#include <sched.h>
#include <unistd.h>
#if defined(_OPENMP)
#include <omp.h>
#endif

namespace gart_cli {

namespace fs = std::filesystem;

namespace {

constexpr int most_each = 16;

std::string own_group() {
  std::ifstream in("/proc/self/cgroup");
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("0::")) return line.substr(3);
  return "/";
}

}  // namespace

int processors_of_quota(fs::path const& mount, std::string const& own) {
  double least = 0;
  fs::path group = fs::path(own).relative_path();
  while (true) {
    std::ifstream in(mount / group / "cpu.max");
    std::string quota;
    double period = 0;
    if (in >> quota >> period && quota != "max" && period > 0) {
      double const share = std::atof(quota.c_str()) / period;
      if (share > 0) least = least > 0 ? std::min(least, share) : share;
    }
    if (group.empty()) break;
    group = group.parent_path();
  }
  return static_cast<int>(std::min(std::ceil(least), 1e6));
}

void bound_threads(char** argv) {
#if defined(_OPENMP)
  if (!std::getenv("OMP_WAIT_POLICY") && !std::getenv("GOMP_SPINCOUNT")) {
    ::setenv("OMP_WAIT_POLICY", "passive", 1);
    ::execv("/proc/self/exe", argv);  // where that cannot be, threads spin
  }
  cpu_set_t set;
  int const allowed = ::sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : omp_get_num_procs();
  int const quota = processors_of_quota("/sys/fs/cgroup", own_group());
  int const runnable = std::max(1, quota > 0 ? std::min(allowed, quota) : allowed);
  bool const asked = std::getenv("OMP_NUM_THREADS") != nullptr;
  omp_set_num_threads(std::clamp(omp_get_max_threads(), 1, asked ? most_each * runnable : runnable));
#else
  static_cast<void>(argv);
#endif
}

}  // namespace gart_cli
