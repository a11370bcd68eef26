#include "bulk_range.hpp"

#include <gart/core/error.hpp>
#include <gart/view/shown_features.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace gart {

namespace {

constexpr std::size_t directions = 3;

std::size_t width_of(feature_view<float const> const& f) { return static_cast<std::size_t>(f.width); }

// Rows of the covariance of every so many Gaussians.
std::vector<double> covariance_of(feature_view<float const> const& f) {
  std::size_t const n = f.count, w = width_of(f);
  std::size_t const taken = std::clamp<std::size_t>(200000000 / (w * w), 1024, 16384), every = std::max(n / taken, {1});
  std::vector<double> mean(w), cov(w * w), off(w);
  std::size_t rows = 0;
  for (std::size_t i = 0; i < n; i += every, ++rows)
    for (std::size_t k = 0; k < w; ++k) mean[k] += static_cast<double>(f.values[i * w + k]);
  for (double& m : mean) m /= static_cast<double>(std::max<std::size_t>(rows, 1));
  for (std::size_t i = 0; i < n; i += every) {
    for (std::size_t k = 0; k < w; ++k) off[k] = static_cast<double>(f.values[i * w + k]) - mean[k];
    for (std::size_t k = 0; k < w; ++k)
      for (std::size_t l = 0; l < w; ++l) cov[k * w + l] += off[k] * off[l];
  }
  return cov;
}

double dot(double const* a, double const* b, std::size_t n) {
  double sum = 0;
  for (std::size_t k = 0; k < n; ++k) sum += a[k] * b[k];
  return sum;
}

// At right angles to each other and of length 1; zero where nothing is left of one.
void straighten(std::vector<double>& v, std::size_t w) {
  for (std::size_t d = 0; d < directions; ++d) {
    double* const own = &v[d * w];
    double const before = std::sqrt(dot(own, own, w));
    for (std::size_t e = 0; e < d; ++e) {
      double const along = dot(own, &v[e * w], w);
      for (std::size_t k = 0; k < w; ++k) own[k] -= along * v[e * w + k];
    }
    double const length = std::sqrt(dot(own, own, w));
    bool const left = length > 1e-12 * before && length > 0;
    for (std::size_t k = 0; k < w; ++k) own[k] = left ? own[k] / length : 0;
  }
}

}  // namespace

std::vector<double> principal_directions(feature_view<float const> const& f) {
  constexpr int steps = 100;
  std::size_t const w = width_of(f);
  std::vector<double> const cov = covariance_of(f);
  // Starts a little aside of the axes of the largest variances. So no direction is at right angles to all.
  std::vector<std::size_t> by_variance(w);
  for (std::size_t k = 0; k < w; ++k) by_variance[k] = k;
  std::stable_sort(by_variance.begin(), by_variance.end(),
                   [&](std::size_t a, std::size_t b) { return cov[a * w + a] > cov[b * w + b]; });
  std::vector<double> v(directions * w), next(directions * w);
  for (std::size_t d = 0; d < directions; ++d)
    for (std::size_t k = 0; k < w; ++k)
      v[d * w + k] = (d < w && k == by_variance[d]) + 1e-2 * std::cos(static_cast<double>(k * (d + 1)));
  straighten(v, w);
  for (int step = 0; step < steps; ++step) {
    for (std::size_t d = 0; d < directions; ++d)
      for (std::size_t k = 0; k < w; ++k) next[d * w + k] = dot(&cov[k * w], &v[d * w], w);
    straighten(next, w);
    v.swap(next);
  }
  for (std::size_t d = 0; d < directions; ++d) {
    double* const own = &v[d * w];
    double const largest =
        *std::max_element(own, own + w, [](double a, double b) { return std::abs(a) < std::abs(b); });
    if (largest < 0)
      for (std::size_t k = 0; k < w; ++k) own[k] = -own[k];
  }
  return v;
}

shown_features features_to_show(feature_view<float const> const& f, std::vector<int> const& wanted) {
  if (f.width == 0)
    throw invalid_argument("view_mode::features: the model has no features (a PLY keeps them as feature_0 and on)");
  if (wanted.size() > 1 && wanted.size() != directions)
    throw invalid_argument("view_settings.features: give one feature, three, or none for principal directions");
  std::size_t const n = f.count, w = width_of(f);
  shown_features out;
  out.count = wanted.size() == 1 ? 1 : static_cast<int>(directions);
  std::size_t const count = static_cast<std::size_t>(out.count);
  out.values.resize(n * count);
  std::vector<double> const along = wanted.empty() ? principal_directions(f) : std::vector<double>();
  std::vector<float> one(n);
  for (std::size_t c = 0; c < count; ++c) {
    if (!wanted.empty() && (wanted[c] < 0 || wanted[c] >= f.width))
      throw invalid_argument("view_settings.features: there is no feature " + std::to_string(wanted[c]) +
                             ", they go from 0 to " + std::to_string(f.width - 1));
    for (std::size_t i = 0; i < n; ++i) {
      double sum = 0;
      if (wanted.empty())
        for (std::size_t k = 0; k < w; ++k) sum += along[c * w + k] * static_cast<double>(f.values[i * w + k]);
      one[i] = wanted.empty() ? static_cast<float>(sum) : f.values[i * w + static_cast<std::size_t>(wanted[c])];
    }
    auto const range = view::bulk_range(one, {0.0f, 1.0f});
    out.ranges.push_back(range);
    float const extent = range.second - range.first;
    for (std::size_t i = 0; i < n; ++i) out.values[i * count + c] = extent > 0 ? (one[i] - range.first) / extent : 0.5f;
  }
  return out;
}

}  // namespace gart
