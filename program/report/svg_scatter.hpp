#pragma once
// Points over two logarithmic axes as inline SVG, with a line along the Pareto front. Colours come from the page's
// style sheet (classes line-1, dim, grid, tick, label).

#include <string>
#include <vector>

namespace gart_cli {

struct scatter_point {
  double x, y;
  std::string label;
  bool front = false;
};

struct scatter {
  std::string title, x_label, y_label;
  std::vector<scatter_point> points;  // those that are not positive and finite are left out
};

// A <figure> the width of the page. Labels keep clear of each other and of the points. A point without room for a label
// shows its name under the pointer. "" for less than two points.
std::string to_svg(scatter const& plot);

}  // namespace gart_cli
