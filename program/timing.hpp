#pragma once
// Wall time, and processor time: the cost of a step where other programs share the machine.

#include <algorithm>
#include <chrono>
#include <ctime>
#include <vector>

namespace gart_cli {

// From its making on.
class stopwatch {
 public:
  double seconds() const { return std::chrono::duration<double>(clock::now() - start_).count(); }
  double milliseconds() const { return 1000 * seconds(); }

 private:
  using clock = std::chrono::steady_clock;
  clock::time_point start_ = clock::now();
};

// Milliseconds of all of the program's threads, from a start of its own.
inline double processor_ms() { return 1000.0 * static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  std::size_t const n = values.size();
  return n == 0 ? 0 : n % 2 ? values[n / 2] : 0.5 * (values[n / 2 - 1] + values[n / 2]);
}

}  // namespace gart_cli
