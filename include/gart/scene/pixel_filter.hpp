#pragma once
// The filter of a camera's pixels (render_options.antialias): a Gaussian whose standard deviation at a point is so many
// pixels, as far as a pixel reaches there,
//   r = pixels x angle of a pixel x distance,   angle = the square root of a pixel's solid angle,
// which for slopes x, y through a lens of Jacobian J (scene/camera.hpp; 1 without one) is
//   angle^2 = (1 + x^2 + y^2)^-3/2 / (fx fy det J).
// Means beside the image, and behind the camera, take the slopes of the image's nearest border. What widens a Gaussian
// by r is math/widened.hpp. Fixed arithmetic where r is made: the same bits on every policy.

#include <gart/math/widened.hpp>
#include <gart/scene/parameters.hpp>
#include <gart/scene/seen_slopes.hpp>

namespace gart::inline GART_ISA {

class pixel_filter {
 public:
  // Host side. invalid_argument for a camera that no ray can be cast by.
  pixel_filter(camera const& c, float pixels)
      : position_(c.position), right_(c.rotation[0]), down_(c.rotation[1]), forward_(c.rotation[2]), lens_(c.lens) {
    require_camera(c);
    size_ = static_cast<float>(pixels / std::sqrt(double{c.fx} * c.fy));
    seen_slopes const s = slopes_seen(c);
    x0_ = static_cast<float>(s.x0), x1_ = static_cast<float>(s.x1);
    y0_ = static_cast<float>(s.y0), y1_ = static_cast<float>(s.y1);
  }

  GART_HD GART_INLINE vec3 from_camera(gaussian_parameters const& g) const { return relative_mean(g.mean, position_); }

  // At a mean relative to the camera.
  GART_HD GART_INLINE float sigma_at(vec3 const& m) const { return evaluate(m).sigma; }

  GART_HD GART_INLINE filter_at at(vec3 const& m) const {
    point const p = evaluate(m);
    float const square = p.distance * p.distance;
    filter_at out{p.sigma, square > 0 ? m / square : vec3(0.0f)};
    float by_x = -1.5f * p.x / p.l2, by_y = -1.5f * p.y / p.l2;
    if (p.lens.det > least_det) {
      lens_slope const slope = slope_of(p);
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

  struct jacobian {
    float xx = 1, xy = 0, yy = 1, det = 1;
  };
  struct point {
    float sigma, distance, z, x, y, l2;
    bool free_x, free_y;  // between the image's borders
    jacobian lens;
  };
  struct lens_slope {
    float x, y;
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
    if (lens_.any()) p.lens = jacobian_at(p.x, p.y);
    float const det = p.lens.det > least_det ? p.lens.det : least_det;
    float const length = square_root(p.l2);
    float const inverse_angle = mul(mul(length, square_root(length)), square_root(det));  // in units of size_
    p.sigma = divide(mul(size_, p.distance), inverse_angle);
    return p;
  }

  GART_HD GART_INLINE jacobian jacobian_at(float x, float y) const {
    float const r2 = fma(x, x, mul(y, y));
    float const radial = fma(r2, fma(r2, lens_.k2, lens_.k1), 1.0f);
    float const slope = fma(mul(4.0f, lens_.k2), r2, mul(2.0f, lens_.k1));  // d radial / d x = slope * x
    jacobian j;
    j.xx = fma(mul(slope, x), x, fma(mul(2.0f, lens_.p1), y, fma(mul(6.0f, lens_.p2), x, radial)));
    j.xy = fma(mul(slope, x), y, fma(mul(2.0f, lens_.p1), x, mul(mul(2.0f, lens_.p2), y)));
    j.yy = fma(mul(slope, y), y, fma(mul(2.0f, lens_.p2), x, fma(mul(6.0f, lens_.p1), y, radial)));
    j.det = fma(j.xx, j.yy, -mul(j.xy, j.xy));
    return j;
  }

  // Of the Jacobian's determinant.
  GART_HD GART_INLINE lens_slope slope_of(point const& p) const {
    if (!lens_.any()) return {0, 0};
    float const x = p.x, y = p.y, r2 = x * x + y * y;
    float const slope = 2 * lens_.k1 + 4 * lens_.k2 * r2, bend = 8 * lens_.k2;
    float const xxx = 3 * slope * x + bend * x * x * x + 6 * lens_.p2,
                xxy = slope * y + bend * x * x * y + 2 * lens_.p1;
    float const xyy = slope * x + bend * x * y * y + 2 * lens_.p2,
                yyy = 3 * slope * y + bend * y * y * y + 6 * lens_.p1;
    jacobian const& j = p.lens;
    return {xxx * j.yy + j.xx * xyy - 2 * j.xy * xxy, xxy * j.yy + j.xx * yyy - 2 * j.xy * xyy};
  }

  vec3d position_;
  vec3 right_, down_, forward_;
  distortion lens_;
  float size_ = 0;  // pixels over the focal length: the standard deviation's angle on the axis
  float x0_ = 0, x1_ = 0, y0_ = 0, y1_ = 0;
};

// As the pixels of a camera see it.
GART_HD GART_INLINE gaussian_parameters filtered(gaussian_parameters const& g, pixel_filter const& filter) {
  vec3 const mean = filter.from_camera(g);
  return widened(g, mean, filter.sigma_at(mean));
}

}  // namespace gart::inline GART_ISA
