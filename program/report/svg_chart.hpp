#pragma once
// Line charts as inline SVG. Colours come from the page's style sheet (classes line-1 to line-6, grid, tick), so charts
// follow its dark mode.

#include <string>
#include <utility>
#include <vector>

namespace gart_cli {

struct chart_series {
  std::string name;
  std::vector<std::pair<double, double>> points;  // x ascending; points that are not finite are left out
  bool markers = false;                           // a dot on each point: few and exact, against many and averaged
};

struct chart {
  std::string title, unit, x_label;
  std::vector<chart_series> series;  // at most six
  bool logarithmic = false;          // y; values that are not positive are left out
  double x_max = 0;
  bool from_zero = false;  // y
  bool counts = false;     // y: whole numbers
};

// A <figure> with the title, the last value of each series, and the plot. "" where no series has two points.
std::string to_svg(chart const& c);

std::string html_escape(std::string const& text);

}  // namespace gart_cli
