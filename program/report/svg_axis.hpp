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

// The area of a plot in its picture, with its axes.
struct chart_area {
  double width, height, left, right, top, bottom;  // of the picture, and its margins
  chart_axis x, y;

  double at_x(double v) const { return left + x.place(v) * (width - left - right); }
  double at_y(double v) const { return height - bottom - y.place(v) * (height - top - bottom); }
  // The start of an <svg> with the ticks; `upright` lines too, at those of x.
  std::string begin(std::string const& title, std::string const& x_label, bool upright) const;
};
std::string svg_number(double v);  // a place in a picture

}  // namespace gart_cli
