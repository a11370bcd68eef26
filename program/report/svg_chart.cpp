#include "svg_chart.hpp"

#include "progress.hpp"
#include "svg_axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gart_cli {

std::string html_escape(std::string const& text) {
  std::string result;
  for (char const c : text) {
    switch (c) {
      case '&':
        result += "&amp;";
        break;
      case '<':
        result += "&lt;";
        break;
      case '>':
        result += "&gt;";
        break;
      case '"':
        result += "&quot;";
        break;
      default:
        result += c;
    }
  }
  return result;
}

std::string to_svg(chart const& c) {
  double const infinity = std::numeric_limits<double>::infinity();
  double low = infinity, high = -infinity, x_low = infinity, x_high = c.x_max;
  std::size_t most = 0;
  std::vector<chart_series> series = c.series;
  for (auto& s : series) {
    std::erase_if(s.points, [&](auto const& p) {
      return !std::isfinite(p.first) || !std::isfinite(p.second) || (c.logarithmic && !(p.second > 0));
    });
    for (auto const& [x, y] : s.points) {
      low = std::min(low, y), high = std::max(high, y);
      x_low = std::min(x_low, x), x_high = std::max(x_high, x);
    }
    most = std::max(most, s.points.size());
  }
  if (most < 2) return "";
  if (c.from_zero) low = 0;

  chart_axis const x = linear_axis(std::min(x_low, 0.0), x_high, 6, false),
                   y = c.logarithmic ? log_axis(low, high) : linear_axis(low, high, 4, true);
  chart_area const area{560, 230, 46, 14, 10, 34, x, y};
  auto const at = [&](auto const& p) {
    return std::pair(svg_number(area.at_x(p.first)), svg_number(area.at_y(p.second)));
  };

  std::string svg = "<figure class=\"chart\"><figcaption><b>" + html_escape(c.title) + "</b>";
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (series[i].points.empty()) continue;
    double const last = series[i].points.back().second;
    std::string const swatch = "<i class=\"swatch-" + std::to_string(i + 1) + "\"></i>";
    svg += "<span class=\"key\">" + (series[i].name.empty() ? "" : swatch + html_escape(series[i].name) + " ") +
           (c.counts || last >= 1000 ? with_commas(static_cast<std::uint64_t>(std::llround(last)))
                                     : fixed(last, last < 1 ? 4 : 2)) +
           html_escape(c.unit.empty() ? "" : " " + c.unit) + "</span>";
  }
  svg += "</figcaption>" + area.begin(c.title, c.x_label, false);
  for (std::size_t i = 0; i < series.size(); ++i) {
    std::string const color = "line-" + std::to_string(i + 1);
    svg += "<polyline class=\"" + color + "\" points=\"";
    for (auto const& p : series[i].points) svg += at(p).first + "," + at(p).second + " ";
    svg += "\"/>";
    if (!series[i].markers) continue;
    for (auto const& p : series[i].points)
      svg += "<circle class=\"" + color + "\" r=\"3\" cx=\"" + at(p).first + "\" cy=\"" + at(p).second + "\"/>";
  }
  return svg + "</svg></figure>";
}

}  // namespace gart_cli
