#pragma once
// The most memory that this process has held in RAM so far, in bytes.

#include <sys/resource.h>

namespace gart_cli {

inline double peak_process_bytes() {
  rusage use{};
  getrusage(RUSAGE_SELF, &use);
#if defined(__APPLE__)
  return static_cast<double>(use.ru_maxrss);
#else
  return 1024.0 * static_cast<double>(use.ru_maxrss);
#endif
}

}  // namespace gart_cli
