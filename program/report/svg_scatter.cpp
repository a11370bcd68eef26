#include "svg_scatter.hpp"

#include "progress.hpp"
#include "svg_axis.hpp"
#include "svg_chart.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gart_cli {

namespace {

constexpr double width = 1100, height = 520, left = 64, right = 24, top = 16, bottom = 46;
constexpr double dot = 4.5, letter = 6.3, line = 14;

std::string number(double v) { return fixed(v, 1); }

struct rectangle {
  double x0, y0, x1, y1;
  bool meets(rectangle const& o) const { return x0 < o.x1 && o.x0 < x1 && y0 < o.y1 && o.y0 < y1; }
};

// Where labels go: beside the point first, then further off, at the end of a thin line.
class labels {
 public:
  explicit labels(std::vector<rectangle> dots) : taken_(std::move(dots)) {}

  std::string place(double x, double y, scatter_point const& p) {
    static constexpr double sides[][2] = {{1, 0}, {-1, 0}, {1, -1}, {1, 1}, {-1, -1}, {-1, 1}, {0, -1}, {0, 1}};
    double const wide = letter * static_cast<double>(p.label.size());
    for (double const reach : {8.0, 20.0, 36.0, 56.0, 80.0, 110.0}) {
      if (reach > 40 && !p.front) break;
      for (auto const& [across, down] : sides) {
        double const at_x = x + across * reach, at_y = y + down * reach;
        double const x0 = across > 0 ? at_x : across < 0 ? at_x - wide : at_x - wide / 2;
        rectangle const box{x0, at_y - line / 2, x0 + wide, at_y + line / 2};
        if (box.x0 < left || box.x1 > width - 2 || box.y0 < top || box.y1 > height - bottom) continue;
        if (std::any_of(taken_.begin(), taken_.end(), [&](rectangle const& o) { return box.meets(o); })) continue;
        taken_.push_back(box);
        std::string const leader = reach > 10 ? "<line class=\"leader\" x1=\"" + number(x) + "\" y1=\"" + number(y) +
                                                    "\" x2=\"" + number(at_x) + "\" y2=\"" + number(at_y) + "\"/>"
                                              : "";
        return leader + "<text class=\"label" + (p.front ? "" : " dim") + "\" x=\"" + number(box.x0) + "\" y=\"" +
               number(at_y + 4) + "\">" + html_escape(p.label) + "</text>";
      }
    }
    return "";
  }

 private:
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
  auto const at_x = [&](double v) { return left + x.place(v) * (width - left - right); };
  auto const at_y = [&](double v) { return height - bottom - y.place(v) * (height - top - bottom); };

  std::string svg = "<figure class=\"chart\"><figcaption><b>" + html_escape(plot.title) + "</b><span class=\"key\">" +
                    html_escape(plot.y_label) + "</span></figcaption><svg viewBox=\"0 0 " + fixed(width, 0) + " " +
                    fixed(height, 0) + "\" role=\"img\" aria-label=\"" + html_escape(plot.title) + "\">";
  for (auto const& [value, text] : y.ticks) {
    svg += "<line class=\"grid\" x1=\"" + number(left) + "\" x2=\"" + number(width - right) + "\" y1=\"" +
           number(at_y(value)) + "\" y2=\"" + number(at_y(value)) +
           "\"/><text class=\"tick\" text-anchor=\"end\" x=\"" + number(left - 7) + "\" y=\"" +
           number(at_y(value) + 3.5) + "\">" + text + "</text>";
  }
  for (auto const& [value, text] : x.ticks) {
    svg += "<line class=\"grid\" y1=\"" + number(top) + "\" y2=\"" + number(height - bottom) + "\" x1=\"" +
           number(at_x(value)) + "\" x2=\"" + number(at_x(value)) +
           "\"/><text class=\"tick\" text-anchor=\"middle\" x=\"" + number(at_x(value)) + "\" y=\"" +
           number(height - bottom + 18) + "\">" + text + "</text>";
  }
  svg += "<text class=\"tick\" text-anchor=\"end\" x=\"" + number(width - right) + "\" y=\"" + number(height - 6) +
         "\">" + html_escape(plot.x_label) + "</text>";

  // A step for each point of the front: the value reached in that time.
  std::string front;
  double last = 0;
  for (auto const& p : points) {
    if (!p.front) continue;
    if (!front.empty()) front += number(at_x(p.x)) + "," + number(last) + " ";
    last = at_y(p.y);
    front += number(at_x(p.x)) + "," + number(last) + " ";
  }
  svg += "<polyline class=\"line-1\" points=\"" + front + "\"/>";
  std::vector<rectangle> dots;
  for (auto const& p : points) dots.push_back({at_x(p.x) - dot, at_y(p.y) - dot, at_x(p.x) + dot, at_y(p.y) + dot});
  for (auto p = points.rbegin(); p != points.rend(); ++p) {
    svg += std::string("<circle class=\"") + (p->front ? "line-1" : "dim") + "\" r=\"" + number(dot) + "\" cx=\"" +
           number(at_x(p->x)) + "\" cy=\"" + number(at_y(p->y)) + "\"><title>" + html_escape(p->label) + ": " +
           fixed(p->x, 2) + " ms</title></circle>";
  }
  labels names(std::move(dots));
  for (auto const& p : points) svg += names.place(at_x(p.x), at_y(p.y), p);
  return svg + "</svg></figure>";
}

}  // namespace gart_cli
