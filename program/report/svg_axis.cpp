#include "svg_axis.hpp"

#include "progress.hpp"
#include "svg_chart.hpp"

#include <algorithm>
#include <cmath>

namespace gart_cli {

namespace {

// "12k" for 12000, "1e-5" for what has many zeros, and no more decimals than tell ticks `step` apart.
std::string tick_text(double value, double step) {
  if (std::abs(value) >= 1e6) return fixed(value / 1e6, step < 1e6 ? 1 : 0) + "M";
  if (std::abs(value) >= 1e4 || (std::abs(value) >= 1e3 && step >= 100)) {
    return fixed(value / 1e3, step < 1e3 ? 1 : 0) + "k";
  }
  if (value > 0 && value < 1e-3 * (1 - 1e-9)) {
    double const exponent = std::floor(std::log10(value) + 1e-9);
    return fixed(value / std::pow(10.0, exponent), 0) + "e" + fixed(exponent, 0);
  }
  return fixed(value, step >= 1 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9)));
}

double nice_step(double range, int ticks) {
  double const rough = range / ticks, power = std::pow(10.0, std::floor(std::log10(rough)));
  double const mantissa = rough / power;
  return power * (mantissa <= 1 ? 1 : mantissa <= 2 ? 2 : mantissa <= 5 ? 5 : 10);
}

}  // namespace

double chart_axis::place(double v) const {
  return logarithmic ? (std::log(v) - std::log(low)) / (std::log(high) - std::log(low)) : (v - low) / (high - low);
}

chart_axis linear_axis(double low, double high, int ticks, bool round_ends) {
  if (!(high > low)) low -= 0.5 * std::max(1e-3, std::abs(low)), high = low + std::max(1e-3, std::abs(low) * 1.5);
  double const step = nice_step(high - low, ticks);
  chart_axis a;
  a.low = round_ends ? std::floor(low / step + 1e-9) * step : low;
  a.high = round_ends ? std::ceil(high / step - 1e-9) * step : high;
  for (double v = std::ceil(a.low / step - 1e-9) * step; v <= a.high + 1e-9 * step; v += step) {
    a.ticks.emplace_back(v, tick_text(std::abs(v) < 1e-9 * step ? 0 : v, step));
  }
  return a;
}

chart_axis log_axis(double low, double high) {
  chart_axis a;
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

std::string svg_number(double v) { return fixed(v, 1); }

std::string chart_area::begin(std::string const& title, std::string const& x_label, bool upright) const {
  auto const n = svg_number;
  std::string svg = "<svg viewBox=\"0 0 " + fixed(width, 0) + " " + fixed(height, 0) + "\" role=\"img\" aria-label=\"" +
                    html_escape(title) + "\">";
  for (auto const& [value, text] : y.ticks) {
    svg += "<line class=\"grid\" x1=\"" + n(left) + "\" x2=\"" + n(width - right) + "\" y1=\"" + n(at_y(value)) +
           "\" y2=\"" + n(at_y(value)) + "\"/><text class=\"tick\" text-anchor=\"end\" x=\"" + n(left - 7) + "\" y=\"" +
           n(at_y(value) + 3.5) + "\">" + text + "</text>";
  }
  for (auto const& [value, text] : x.ticks) {
    if (upright)
      svg += "<line class=\"grid\" y1=\"" + n(top) + "\" y2=\"" + n(height - bottom) + "\" x1=\"" + n(at_x(value)) +
             "\" x2=\"" + n(at_x(value)) + "\"/>";
    svg += "<text class=\"tick\" text-anchor=\"middle\" x=\"" + n(at_x(value)) + "\" y=\"" + n(height - bottom + 16) +
           "\">" + text + "</text>";
  }
  return svg + "<text class=\"tick\" text-anchor=\"end\" x=\"" + n(width - right) + "\" y=\"" + n(height - 3) + "\">" +
         html_escape(x_label) + "</text>";
}

}  // namespace gart_cli
