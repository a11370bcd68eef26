#include "svg_scatter.hpp"

#include "progress.hpp"
#include "svg_axis.hpp"
#include "svg_chart.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gart_cli {

namespace {

constexpr double dot = 4.5, letter = 6.3, line = 14;

struct rectangle {
  double x0, y0, x1, y1;
  bool meets(rectangle const& o) const { return x0 < o.x1 && o.x0 < x1 && y0 < o.y1 && o.y0 < y1; }
};

// Where labels go: beside the point first, then further off, at the end of a thin line.
class labels {
 public:
  labels(chart_area const& area, std::vector<rectangle> dots) : area_(area), taken_(std::move(dots)) {}

  std::string place(double x, double y, scatter_point const& p) {
    static constexpr double sides[][2] = {{1, 0}, {-1, 0}, {1, -1}, {1, 1}, {-1, -1}, {-1, 1}, {0, -1}, {0, 1}};
    double const wide = letter * static_cast<double>(p.label.size());
    for (double const reach : {8.0, 20.0, 36.0, 56.0, 80.0, 110.0}) {
      if (reach > 40 && !p.front) break;
      for (auto const& [across, down] : sides) {
        double const at_x = x + across * reach, at_y = y + down * reach;
        double const x0 = across > 0 ? at_x : across < 0 ? at_x - wide : at_x - wide / 2;
        rectangle const box{x0, at_y - line / 2, x0 + wide, at_y + line / 2};
        if (box.x0 < area_.left || box.x1 > area_.width - 2 || box.y0 < area_.top ||
            box.y1 > area_.height - area_.bottom)
          continue;
        if (std::any_of(taken_.begin(), taken_.end(), [&](rectangle const& o) { return box.meets(o); })) continue;
        taken_.push_back(box);
        std::string const leader = reach > 10
                                       ? "<line class=\"leader\" x1=\"" + svg_number(x) + "\" y1=\"" + svg_number(y) +
                                             "\" x2=\"" + svg_number(at_x) + "\" y2=\"" + svg_number(at_y) + "\"/>"
                                       : "";
        return leader + "<text class=\"label" + (p.front ? "" : " dim") + "\" x=\"" + svg_number(box.x0) + "\" y=\"" +
               svg_number(at_y + 4) + "\">" + html_escape(p.label) + "</text>";
      }
    }
    return "";
  }

 private:
  chart_area const& area_;
  std::vector<rectangle> taken_;
};

}  // namespace

std::string to_svg(scatter const& plot) {
  std::vector<scatter_point> points;
  std::copy_if(plot.points.begin(), plot.points.end(), std::back_inserter(points),
               [](scatter_point const& p) { return std::isfinite(p.x) && std::isfinite(p.y) && p.x > 0 && p.y > 0; });
  if (points.size() < 2) return "";
  // The front first: it chooses the places of its labels.
  std::sort(points.begin(), points.end(),
            [](scatter_point const& a, scatter_point const& b) { return a.front != b.front ? a.front : a.x < b.x; });
  auto const [x_low, x_high] =
      std::minmax_element(points.begin(), points.end(), [](auto const& a, auto const& b) { return a.x < b.x; });
  auto const [y_low, y_high] =
      std::minmax_element(points.begin(), points.end(), [](auto const& a, auto const& b) { return a.y < b.y; });
  chart_axis const x = log_axis(x_low->x / 1.1, x_high->x * 1.1), y = log_axis(y_low->y / 1.5, y_high->y * 1.5);
  chart_area const area{1100, 520, 64, 24, 16, 46, x, y};
  std::string svg = "<figure class=\"chart\"><figcaption><b>" + html_escape(plot.title) + "</b><span class=\"key\">" +
                    html_escape(plot.y_label) + "</span></figcaption>" + area.begin(plot.title, plot.x_label, true);

  // A step for each point of the front: the value reached in that time.
  std::string front;
  double last = 0;
  for (auto const& p : points) {
    if (!p.front) continue;
    if (!front.empty()) front += svg_number(area.at_x(p.x)) + "," + svg_number(last) + " ";
    last = area.at_y(p.y);
    front += svg_number(area.at_x(p.x)) + "," + svg_number(last) + " ";
  }
  svg += "<polyline class=\"line-1\" points=\"" + front + "\"/>";
  std::vector<rectangle> dots;
  for (auto const& p : points)
    dots.push_back({area.at_x(p.x) - dot, area.at_y(p.y) - dot, area.at_x(p.x) + dot, area.at_y(p.y) + dot});
  for (auto p = points.rbegin(); p != points.rend(); ++p) {
    svg += std::string("<circle class=\"") + (p->front ? "line-1" : "dim") + "\" r=\"" + svg_number(dot) + "\" cx=\"" +
           svg_number(area.at_x(p->x)) + "\" cy=\"" + svg_number(area.at_y(p->y)) + "\"><title>" +
           html_escape(p->label) + ": " + fixed(p->x, 2) + " ms</title></circle>";
  }
  labels names(area, std::move(dots));
  for (auto const& p : points) svg += names.place(area.at_x(p.x), area.at_y(p.y), p);
  return svg + "</svg></figure>";
}

}  // namespace gart_cli
