#pragma once
/// \file
/// The pixels' filter (render_options.antialias) of a camera whose pixels' solid angle depends only on the angle with
/// an axis. It is a Gaussian. Its standard deviation is so many pixels times the root of a pixel's solid angle times
/// the distance. Beyond the largest angle it goes on as there. The square of the solid angle is a table of 64 straight
/// lines over (1 - cosine) / 2. In this variable it is smooth on the axis and at poles. Images and gradients follow the
/// table; a mean's gradient is within 0.002 of the curve's. Fixed arithmetic where it is made: the same bits on every
/// policy.

#include <gart/math/widened.hpp>

namespace gart { inline namespace GART_ISA {

/// Where it stands, and how wide it is there.
class axial_filter {
 public:
  axial_filter() = default;
  /// Host side. solid_angle: of a pixel, by the angle with the axis, from 0 to `last`.
  template <class F>
  axial_filter(vec3d const& position, vec3 const& axis, double pixels, double last, F const& solid_angle)
      : position_(position), axis_(axis), pixels_(static_cast<float>(pixels)) {
    for (int i = 0; i <= nodes; ++i) {
      double const theta = 2 * std::asin(std::sqrt(i / double{nodes}));
      double const angle = solid_angle(theta < last ? theta : last);
      square_[i] = static_cast<float>(angle * angle);
    }
  }

  /// The mean relative to the camera.
  GART_HD GART_INLINE vec3 from_camera(gaussian_parameters const& g) const { return relative_mean(g.mean, position_); }

  /// At a mean relative to the camera.
  GART_HD GART_INLINE float sigma_at(vec3 const& m) const { return evaluate(m).sigma; }

  /// The same, and how it changes with the mean.
  GART_HD GART_INLINE filter_at at(vec3 const& m) const {
    point const p = evaluate(m);
    if (!(p.distance > 0)) return {p.sigma, vec3(0.0f)};
    vec3 const v = m / p.distance;
    // d place / d m = -(axis - v cosine) / (2 distance)
    vec3 const turn = (v * p.cosine - axis_) * (0.5f / p.distance);
    return {p.sigma, v / p.distance + turn * (0.25f * p.slope / p.square)};
  }

 private:
  static constexpr int nodes = 64;

  struct point {
    float sigma, distance, cosine, square, slope;
  };
  GART_HD GART_INLINE static float dot(vec3 const& a, vec3 const& b) {
    return fma(a.x, b.x, fma(a.y, b.y, mul(a.z, b.z)));
  }
  GART_HD GART_INLINE point evaluate(vec3 const& m) const {
    point p;
    p.distance = square_root(dot(m, m));
    p.cosine = p.distance > 0 ? divide(dot(m, axis_), p.distance) : 1.0f;
    float const place = mul(fma(-0.5f, p.cosine, 0.5f), static_cast<float>(nodes));
    float const inside = place > 0 ? place < nodes - 0.001f ? place : nodes - 0.001f : 0.0f;
    int const cell = static_cast<int>(inside);
    float const lo = square_[cell], rise = add(square_[cell + 1], -lo);
    p.square = fma(rise, add(inside, -static_cast<float>(cell)), lo), p.slope = rise * nodes;
    p.sigma = mul(mul(pixels_, p.distance), square_root(square_root(p.square)));
    return p;
  }

  vec3d position_{0.0};
  vec3 axis_{0.0f};
  float pixels_ = 0;
  float square_[nodes + 1] = {};
};

}}  // namespace gart::GART_ISA
