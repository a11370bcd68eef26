#pragma once
// Axes of charts: a range with round ticks, and where a value lies on it.

#include <string>
#include <utility>
#include <vector>

namespace gart_cli {

struct chart_axis {
  double low = 0, high = 1;
  bool logarithmic = false;
  std::vector<std::pair<double, std::string>> ticks;

  double place(double v) const;  // 0 at low, 1 at high
};

chart_axis linear_axis(double low, double high, int ticks, bool round_ends);
chart_axis log_axis(double low, double high);  // both positive

}  // namespace gart_cli
