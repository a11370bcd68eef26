#pragma once
/// \file
/// The pixels' filter of a camera that projects slopes (render_options.antialias). It is a Gaussian. At a point its
/// standard deviation is so many pixels, as far as a pixel reaches there:
///   r = pixels x angle of a pixel x distance,   angle = the square root of a pixel's solid angle,
/// which for slopes x, y through a lens of Jacobian J (1 without one) is
///   angle^2 = (1 + x^2 + y^2)^-3/2 / (fx fy det J).
/// Means beside the image, and behind the camera, take the slopes of the image's nearest border. What widens a Gaussian
/// by r is math/widened.hpp. Fixed arithmetic where r is made: the same bits on every policy.

#include <gart/camera/seen_slopes.hpp>
#include <gart/math/widened.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// Of the image by the slopes, symmetric.
struct lens_jacobian {
  float xx = 1, xy = 0, yy = 1, det = 1;  ///< and its determinant
};

/// Lens: jacobian_at(x, y), and how its determinant changes there.
struct no_lens {
  /// The identity.
  GART_HD GART_INLINE lens_jacobian jacobian_at(float, float) const { return {}; }
  /// It does not change.
  GART_HD GART_INLINE vec2 slope_of_det(lens_jacobian const&, float, float) const { return {0, 0}; }
};

/// The filter: where it stands, and how wide it is there.
template <class Lens = no_lens>
class slope_filter {
 public:
  /// Host side. View: position, rotation, focal lengths.
  template <class View>
  slope_filter(View const& c, Lens const& lens, seen_slopes const& s, float pixels)
      : position_(c.position),
        right_(c.rotation[0]),
        down_(c.rotation[1]),
        forward_(c.rotation[2]),
        lens_(lens),
        size_(static_cast<float>(pixels / std::sqrt(double{c.fx} * c.fy))),
        x0_(static_cast<float>(s.x0)),
        x1_(static_cast<float>(s.x1)),
        y0_(static_cast<float>(s.y0)),
        y1_(static_cast<float>(s.y1)) {}

  /// The mean relative to the camera.
  GART_HD GART_INLINE vec3 from_camera(gaussian_parameters const& g) const { return relative_mean(g.mean, position_); }

  /// At a mean relative to the camera.
  GART_HD GART_INLINE float sigma_at(vec3 const& m) const { return evaluate(m).sigma; }

  /// The same, and how it changes with the mean.
  GART_HD GART_INLINE filter_at at(vec3 const& m) const {
    point const p = evaluate(m);
    float const square = p.distance * p.distance;
    filter_at out{p.sigma, square > 0 ? m / square : vec3(0.0f)};
    float by_x = -1.5f * p.x / p.l2, by_y = -1.5f * p.y / p.l2;
    if (p.lens.det > least_det) {
      vec2 const slope = lens_.slope_of_det(p.lens, p.x, p.y);
      by_x -= 0.5f * slope.x / p.lens.det, by_y -= 0.5f * slope.y / p.lens.det;
    }
    if (p.free_x)
      for (int k = 0; k < 3; ++k) out.log_slope[k] += by_x * (right_[k] - p.x * forward_[k]) / p.z;
    if (p.free_y)
      for (int k = 0; k < 3; ++k) out.log_slope[k] += by_y * (down_[k] - p.y * forward_[k]) / p.z;
    return out;
  }

 private:
  // Where a lens folds a pixel would see everything.
  static constexpr float least_det = 0.05f;

  struct point {
    float sigma, distance, z, x, y, l2;
    bool free_x, free_y;  // between the image's borders
    lens_jacobian lens;
  };

  GART_HD GART_INLINE static float dot(vec3 const& a, vec3 const& b) {
    return fma(a.x, b.x, fma(a.y, b.y, mul(a.z, b.z)));
  }
  GART_HD GART_INLINE static float slope_between(float side, float z, float lo, float hi, bool& free) {
    float const slope = z > 0 ? divide(side, z) : side < 0 ? lo : hi;
    free = slope > lo && slope < hi;
    return free ? slope : slope < hi ? lo : hi;
  }

  GART_HD GART_INLINE point evaluate(vec3 const& m) const {
    point p;
    p.z = dot(m, forward_);
    p.x = slope_between(dot(m, right_), p.z, x0_, x1_, p.free_x);
    p.y = slope_between(dot(m, down_), p.z, y0_, y1_, p.free_y);
    p.distance = square_root(dot(m, m));
    p.l2 = fma(p.x, p.x, fma(p.y, p.y, 1.0f));
    p.lens = lens_.jacobian_at(p.x, p.y);
    float const det = p.lens.det > least_det ? p.lens.det : least_det;
    float const length = square_root(p.l2);
    float const inverse_angle = mul(mul(length, square_root(length)), square_root(det));  // in units of size_
    p.sigma = divide(mul(size_, p.distance), inverse_angle);
    return p;
  }

  vec3d position_;
  vec3 right_, down_, forward_;
  Lens lens_;
  float size_ = 0;  // pixels over the focal length: the standard deviation's angle on the axis
  float x0_ = 0, x1_ = 0, y0_ = 0, y1_ = 0;
};

/// As the pixels of a camera see it. Filter: a camera model's.
template <class Filter>
GART_HD GART_INLINE gaussian_parameters filtered(gaussian_parameters const& g, Filter const& filter) {
  vec3 const mean = filter.from_camera(g);
  return widened(g, mean, filter.sigma_at(mean));
}

}}  // namespace gart::GART_ISA
