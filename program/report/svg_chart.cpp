#include "svg_chart.hpp"

#include "progress.hpp"
#include "svg_axis.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gart_cli {

namespace {

constexpr double width = 560, height = 230, left = 46, right = 14, top = 10, bottom = 34;

std::string number(double v) { return fixed(v, 1); }

}  // namespace

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

  chart_axis const x = linear_axis(std::min(x_low, 0.0), x_high, 6, false);
  chart_axis const y = c.logarithmic ? log_axis(low, high) : linear_axis(low, high, 4, true);
  auto const at_x = [&](double v) { return left + x.place(v) * (width - left - right); };
  auto const at_y = [&](double v) { return height - bottom - y.place(v) * (height - top - bottom); };

  std::string svg = "<figure class=\"chart\"><figcaption><b>" + html_escape(c.title) + "</b>";
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (series[i].points.empty()) continue;
    double const last = series[i].points.back().second;
    std::string const swatch = "<i class=\"swatch-" + std::to_string(i + 1) + "\"></i>";
    svg +=
        "<span class=\"key\">" + (series[i].name.empty() ? "" : swatch + html_escape(series[i].name) + " ") +
        (last >= 1000 ? with_commas(static_cast<std::uint64_t>(std::llround(last))) : fixed(last, last < 1 ? 4 : 2)) +
        html_escape(c.unit.empty() ? "" : " " + c.unit) + "</span>";
  }
  svg += "</figcaption><svg viewBox=\"0 0 " + fixed(width, 0) + " " + fixed(height, 0) +
         "\" role=\"img\" aria-label=\"" + html_escape(c.title) + "\">";
  for (auto const& [value, text] : y.ticks) {
    svg += "<line class=\"grid\" x1=\"" + number(left) + "\" x2=\"" + number(width - right) + "\" y1=\"" +
           number(at_y(value)) + "\" y2=\"" + number(at_y(value)) +
           "\"/><text class=\"tick\" text-anchor=\"end\" x=\"" + number(left - 7) + "\" y=\"" +
           number(at_y(value) + 3.5) + "\">" + text + "</text>";
  }
  for (auto const& [value, text] : x.ticks) {
    svg += "<text class=\"tick\" text-anchor=\"middle\" x=\"" + number(at_x(value)) + "\" y=\"" +
           number(height - bottom + 16) + "\">" + text + "</text>";
  }
  svg += "<text class=\"tick\" text-anchor=\"end\" x=\"" + number(width - right) + "\" y=\"" + number(height - 3) +
         "\">" + html_escape(c.x_label) + "</text>";
  for (std::size_t i = 0; i < series.size(); ++i) {
    std::string const color = "line-" + std::to_string(i + 1);
    svg += "<polyline class=\"" + color + "\" points=\"";
    for (auto const& [px, py] : series[i].points) svg += number(at_x(px)) + "," + number(at_y(py)) + " ";
    svg += "\"/>";
    if (!series[i].markers) continue;
    for (auto const& [px, py] : series[i].points) {
      svg +=
          "<circle class=\"" + color + "\" r=\"3\" cx=\"" + number(at_x(px)) + "\" cy=\"" + number(at_y(py)) + "\"/>";
    }
  }
  return svg + "</svg></figure>";
}

}  // namespace gart_cli
