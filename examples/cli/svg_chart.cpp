#include "svg_chart.hpp"

#include "progress.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace gart_cli {

namespace {

constexpr double width = 560, height = 230, left = 46, right = 14, top = 10, bottom = 34;

// "12k" for 12000, and no more decimals than tell ticks `step` apart.
std::string tick_text(double value, double step) {
  if (std::abs(value) >= 1e6) return fixed(value / 1e6, step < 1e6 ? 1 : 0) + "M";
  if (std::abs(value) >= 1e4 || (std::abs(value) >= 1e3 && step >= 100)) {
    return fixed(value / 1e3, step < 1e3 ? 1 : 0) + "k";
  }
  return fixed(value, step >= 1 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
}

double nice_step(double range, int ticks) {
  double const rough = range / ticks, power = std::pow(10.0, std::floor(std::log10(rough)));
  double const mantissa = rough / power;
  return power * (mantissa <= 1 ? 1 : mantissa <= 2 ? 2 : mantissa <= 5 ? 5 : 10);
}

struct axis {
  double low = 0, high = 1;
  bool logarithmic = false;
  std::vector<std::pair<double, std::string>> ticks;

  double place(double v) const {
    return logarithmic ? (std::log(v) - std::log(low)) / (std::log(high) - std::log(low)) : (v - low) / (high - low);
  }
};

axis linear_axis(double low, double high, int ticks, bool round_ends) {
  if (!(high > low)) low -= 0.5 * std::max(1e-3, std::abs(low)), high = low + std::max(1e-3, std::abs(low) * 1.5);
  double const step = nice_step(high - low, ticks);
  axis a;
  a.low = round_ends ? std::floor(low / step + 1e-9) * step : low;
  a.high = round_ends ? std::ceil(high / step - 1e-9) * step : high;
  for (double v = std::ceil(a.low / step - 1e-9) * step; v <= a.high + 1e-9 * step; v += step) {
    a.ticks.emplace_back(v, tick_text(std::abs(v) < 1e-9 * step ? 0 : v, step));
  }
  return a;
}

axis log_axis(double low, double high) {
  axis a;
  a.logarithmic = true;
  a.low = low / 1.1, a.high = high * 1.1;
  std::vector<double> const densest{1, 1.5, 2, 3, 4, 6, 8}, dense{1, 2, 5}, sparse{1};
  for (double const m : a.high / a.low < 10 ? densest : a.high / a.low < 200 ? dense : sparse) {
    for (int e = static_cast<int>(std::floor(std::log10(a.low))); e <= std::ceil(std::log10(a.high)); ++e) {
      double const v = m * std::pow(10.0, e);
      if (v >= a.low && v <= a.high)
        a.ticks.emplace_back(v, tick_text(v, std::pow(10.0, std::min(0, e)) * (m == 1.5 ? 0.1 : 1)));
    }
  }
  return a;
}

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

  axis const x = linear_axis(std::min(x_low, 0.0), x_high, 6, false);
  axis const y = c.logarithmic ? log_axis(low, high) : linear_axis(low, high, 4, true);
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
