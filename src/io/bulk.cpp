#include "bulk.hpp"

#include <algorithm>
#include <cmath>

namespace gart::io {

namespace {

constexpr double scale_reach = 4;  // of the others' scales, below which a stray's would take bits from them

double distance(gaussian_model const& m, std::size_t i, vec3d const& from) {
  double most = 0;
  for (int c = 0; c < 3; ++c)
    most = std::max(most, std::abs(static_cast<double>(m.mean[3 * i + static_cast<std::size_t>(c)]) - from[c]));
  return most;
}

}  // namespace

spread spread_of(std::vector<float> values) {
  if (values.empty()) return {};
  spread s;
  s.middle = static_cast<double>(quantile(values, 0.5));
  for (float& v : values) v = static_cast<float>(std::abs(static_cast<double>(v) - s.middle));
  s.half = static_cast<double>(quantile(values, most_of_all));
  return s;
}

std::pair<float, float> bulk_range(std::vector<float> const& values, double reach) {
  if (values.empty()) return {0.0f, 0.0f};
  auto const [least, most] = std::minmax_element(values.begin(), values.end());
  spread const s = spread_of(values);
  if (!(s.half > 0)) return {*least, *most};
  return {std::max(*least, static_cast<float>(s.middle - reach * s.half)),
          std::min(*most, static_cast<float>(s.middle + reach * s.half))};
}

bulk bulk_of(gaussian_model const& model) {
  bulk b;
  std::size_t const n = model.size();
  if (n == 0) return b;
  std::vector<float> values(n);
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t i = 0; i < n; ++i) values[i] = model.mean[3 * i + c];
    b.middle[static_cast<int>(c)] = static_cast<double>(quantile(values, 0.5));
  }
  for (std::size_t i = 0; i < n; ++i) values[i] = static_cast<float>(distance(model, i, b.middle));
  b.half = static_cast<double>(quantile(values, most_of_all));
  for (std::size_t i = 0; i < n && b.half > 0; ++i)
    if (distance(model, i, b.middle) > far_reach * b.half) b.strays.push_back(static_cast<u32>(i));
  return b;
}

std::size_t draw_in_strays(gaussian_model& model, double reach) {
  bulk const b = bulk_of(model);
  if (b.strays.empty()) return 0;
  float const least = bulk_range(model.log_scale, scale_reach).first;
  for (std::size_t const i : b.strays) {
    double const nearer = reach * b.half / distance(model, i, b.middle);
    for (std::size_t c = 0; c < 3; ++c) {
      float& mean = model.mean[3 * i + c];
      double const middle = b.middle[static_cast<int>(c)];
      mean = static_cast<float>(middle + nearer * (static_cast<double>(mean) - middle));
      float& log_scale = model.log_scale[3 * i + c];
      log_scale = std::max(std::min(log_scale, least), log_scale + static_cast<float>(std::log(nearer)));
    }
  }
  return b.strays.size();
}

}  // namespace gart::io
