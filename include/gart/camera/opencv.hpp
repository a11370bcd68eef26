#pragma once
/// \file
/// A pinhole with radial-tangential distortion (COLMAP's SIMPLE_RADIAL, RADIAL and OPENCV). It has u = fx x_d + cx
/// with, for the undistorted (x, y) = (X/Z, Y/Z) and r2 = x*x + y*y,
///   x_d = x (1 + k1 r2 + k2 r2^2) + 2 p1 x y + p2 (r2 + 2 x x),  y_d likewise with p1 and p2 exchanged;
/// a ray inverts it by Newton's method (camera/undistort.hpp).
///
/// The box of a Gaussian that is seen small is that of the map's tangent in the middle of its slopes. The tangent's
/// extremes on the silhouette are exact, as those of a pinhole. The map's curvature widens them by K |h|^2 / 2 at most,
/// with h the half-extents in slopes and K the largest second derivative there.
///
/// Where that is more than a tenth of a pixel, the box is that of any curve of the angle with the axis
/// (camera/lens_bounds.hpp). It is cut by the rectangle of slopes, mapped to the image edge by edge. The map is one to
/// one where the image is. So the image of the rectangle lies within the image of its border. The border is sampled,
/// and widened by the bulge of a curved edge between samples.

#include <gart/camera/lens_bounds.hpp>
#include <gart/camera/pinhole.hpp>
#include <gart/camera/undistort.hpp>

#include <vector>

namespace gart { inline namespace GART_ISA {

/// Boxes of ellipsoids through the lens.
class opencv_bounds {
 public:
  /// Host side: bounds of the image's view, in slopes, by sampling its border.
  opencv_bounds(pinhole const& c, distortion const& lens, seen_slopes const& seen, float near)
      : lens_(lens),
        curved_(tabulated_bounds(camera_kind::perspective, lens, c.fx, c.fy, c.cx, c.cy, c.width, c.height)
                    .seen_from(c.rotation, near)) {
    // The border between samples may bulge a little further.
    double const margin = 0.02;
    double const mu = margin * (seen.x1 - seen.x0), mw = margin * (seen.y1 - seen.y0);
    u_ = {seen.x0 - mu, seen.x1 + mu}, w_ = {seen.y0 - mw, seen.y1 + mw};
    view_ = c.view_of(near * seen.least_cosine * (1 - margin));
    near_ = near;
  }

  /// The pixels that can hit it, and its near depth; empty where none can.
  GART_HD footprint operator()(ellipsoid const& e) const { return box_of(e, curved_); }
  /// The same of those that are seen small; else nothing, and `wide` is set.
  GART_HD footprint narrow(ellipsoid const& e, bool& wide) const {
    return box_of(e, [&](ellipsoid const&) {
      wide = true;
      return footprint{};
    });
  }

 private:
  static constexpr u32 small = 32;           // sides of an image are so many times those of such a box
  static constexpr double most_bulge = 0.1;  // pixels that curvature may add to the tangent's box

  template <class Curved>
  GART_HD footprint box_of(ellipsoid const& e, Curved const& curved_box) const {
    slope_box s;
    footprint out = project(view_, e, s);
    if (!s.visible || s.u.hi + s.error < u_.lo || s.u.lo - s.error > u_.hi || s.w.hi + s.error < w_.lo ||
        s.w.lo - s.error > w_.hi)
      return {};
    if (tangent_box(e, s, out.box)) {
      float const distance = least_distance(e, near_);
      out.depth = distance > out.depth ? distance : out.depth;
      return out.box.empty() ? footprint{} : out;
    }
    footprint const curved = curved_box(e);
    if (curved.box.empty()) return {};
    out.depth = curved.depth > out.depth ? curved.depth : out.depth;  // a distance, which z is at most
    // The slopes take nothing off small ellipsoids.
    if (small * curved.box.width() < u32(view_.width) && small * curved.box.height() < u32(view_.height)) {
      out.box = curved.box;
      return out;
    }
    pixel_box const a = pixels_of(view_, distorted(s)), &b = curved.box;
    out.box = {a.x0 > b.x0 ? a.x0 : b.x0, a.y0 > b.y0 ? a.y0 : b.y0, a.x1 < b.x1 ? a.x1 : b.x1,
               a.y1 < b.y1 ? a.y1 : b.y1};
    if (out.box.empty()) return {};
    return out;
  }

  // False where curvature adds too much.
  GART_HD bool tangent_box(ellipsoid const& e, slope_box const& s, pixel_box& box) const {
    double const x = 0.5 * (s.u.lo + s.u.hi), y = 0.5 * (s.w.lo + s.w.hi);
    double const hx = 0.5 * (s.u.hi - s.u.lo) + s.error, hy = 0.5 * (s.w.hi - s.w.lo) + s.error;
    double const bulge = 0.5 * curvature(fabs(x) + hx, fabs(y) + hy) * (hx * hx + hy * hy);
    if (!(bulge * (view_.fx > view_.fy ? view_.fx : view_.fy) < most_bulge)) return false;
    camera_ellipsoid const seen(view_, e);
    auto const at = lens_curve(camera_kind::perspective, lens_).image_of(x, y);
    // Bounds of value + gx (X/Z - x) + gy (Y/Z - y).
    auto const along = [&](double value, double gx, double gy) {
      detail::interval const t = detail::slope_bounds(gx * seen.m.x + gy * seen.m.y, gx * seen.ax + gy * seen.ay,
                                                      seen.m.z, seen.az, view_.near);
      double const base = value - gx * x - gy * y;
      return detail::interval{base + t.lo - bulge, base + t.hi + bulge};
    };
    slope_box image = s;
    image.u = along(at.x, at.xx, at.xy), image.w = along(at.y, at.yx, at.yy);
    double const to_u = fabs(at.xx) + fabs(at.xy), to_w = fabs(at.yx) + fabs(at.yy);
    image.error *= to_u > to_w ? to_u : to_w;
    box = pixels_of(view_, image);
    return true;
  }

  // Second derivatives of the lens are at most this where |x| <= rx and |y| <= ry.
  GART_HD double curvature(double rx, double ry) const {
    double const r = sqrt(rx * rx + ry * ry);
    return 6 * (fabs(double{lens_.k1}) * r + fabs(double{lens_.p1}) + fabs(double{lens_.p2})) +
           20 * fabs(double{lens_.k2}) * r * r * r;
  }

  GART_HD slope_box distorted(slope_box const& s) const {
    auto const clamp = [](double v, detail::interval const& to) { return v < to.lo ? to.lo : v > to.hi ? to.hi : v; };
    // No pixel sees beyond the view. Kept to the view, the rectangle stays where the lens is one to one.
    double const x0 = clamp(s.u.lo, u_), x1 = clamp(s.u.hi, u_), y0 = clamp(s.w.lo, w_), y1 = clamp(s.w.hi, w_);
    detail::interval u, v;
    constexpr int steps = 4;
    GART_NO_UNROLL
    for (int k = 0; k <= steps; ++k) {
      double const f = static_cast<double>(k) / steps, x = x0 + f * (x1 - x0), y = y0 + f * (y1 - y0);
      double const border[4][2] = {{x, y0}, {x, y1}, {x0, y}, {x1, y}};
      for (auto const& b : border) {
        double a, c;
        distort(lens_, b[0], b[1], a, c);
        u.add(a), v.add(c);
      }
    }
    // A chord of length h bulges h^2 / 8 times the curvature.
    double const rx = fabs(x0) > fabs(x1) ? fabs(x0) : fabs(x1), ry = fabs(y0) > fabs(y1) ? fabs(y0) : fabs(y1);
    double const hx = (x1 - x0) / steps, hy = (y1 - y0) / steps;
    double const bulge = curvature(rx, ry) * (hx * hx + hy * hy) / 8;
    slope_box out = s;
    out.u = {u.lo - bulge, u.hi + bulge}, out.w = {v.lo - bulge, v.hi + bulge};
    return out;
  }

  distortion lens_;
  lens_bounds curved_;
  detail::interval u_, w_;  // slopes the image sees
  footprint_view view_;
  float near_;
};

/// What antialiasing asks of the lens.
struct opencv_lens {
  distortion lens;  ///< its coefficients

  /// How the image moves with the slopes there.
  GART_HD GART_INLINE lens_jacobian jacobian_at(float x, float y) const {
    float const r2 = fma(x, x, mul(y, y));
    float const radial = fma(r2, fma(r2, lens.k2, lens.k1), 1.0f);
    float const slope = fma(mul(4.0f, lens.k2), r2, mul(2.0f, lens.k1));  // d radial / d x = slope * x
    lens_jacobian j;
    j.xx = fma(mul(slope, x), x, fma(mul(2.0f, lens.p1), y, fma(mul(6.0f, lens.p2), x, radial)));
    j.xy = fma(mul(slope, x), y, fma(mul(2.0f, lens.p1), x, mul(mul(2.0f, lens.p2), y)));
    j.yy = fma(mul(slope, y), y, fma(mul(2.0f, lens.p2), x, fma(mul(6.0f, lens.p1), y, radial)));
    j.det = fma(j.xx, j.yy, -mul(j.xy, j.xy));
    return j;
  }

  /// How the Jacobian's determinant j.det changes with the slopes.
  GART_HD GART_INLINE vec2 slope_of_det(lens_jacobian const& j, float x, float y) const {
    float const r2 = x * x + y * y;
    float const slope = 2 * lens.k1 + 4 * lens.k2 * r2, bend = 8 * lens.k2;
    float const xxx = 3 * slope * x + bend * x * x * x + 6 * lens.p2, xxy = slope * y + bend * x * x * y + 2 * lens.p1;
    float const xyy = slope * x + bend * x * y * y + 2 * lens.p2, yyy = 3 * slope * y + bend * y * y * y + 6 * lens.p1;
    return {xxx * j.yy + j.xx * xyy - 2 * j.xy * xxy, xxy * j.yy + j.xx * yyy - 2 * j.xy * xyy};
  }
};

/// A pinhole behind a radial-tangential lens.
struct opencv : camera_base {
  pinhole flat;     ///< without the lens
  distortion lens;  ///< coefficients

  ///@{
  /// From the run-time camera.
  opencv() = default;
  GART_HD explicit opencv(camera const& c) : camera_base(c), flat(c), lens(c.lens) {}
  ///@}

  /// Through the image point (u, v), in pixels.
  template <class F>
  GART_HD GART_INLINE primary_ray_of<F> ray(F u, F v) const {
    F x = divide(add(u, F(-flat.cx)), F(flat.fx)), y = divide(add(v, F(-flat.cy)), F(flat.fy));
    undistort(lens, F(x), F(y), x, y);
    return ray_of_slopes(flat.rotation, x, y);
  }

  /// Focal lengths and principal point.
  intrinsics focal() const { return flat.focal(); }
  /// How rays change with their image points.
  lens_slopes slopes() const { return {camera_kind::perspective, lens, flat.rotation}; }

  /// For hits at t > near.
  opencv_bounds bounds(float near) const {
    require_near(near);
    return {flat, lens, seen(), near};
  }

  /// Of so many pixels.
  slope_filter<opencv_lens> filter(float pixels) const { return {flat, opencv_lens{lens}, seen(), pixels}; }

  /// Of the lens, or of the pinhole behind it.
  camera_fault fault() const {
    if (!(is_finite(lens.k1) && is_finite(lens.k2) && is_finite(lens.p1) && is_finite(lens.p2)))
      return {"the lens distortion is not finite", "correct k1, k2, p1 and p2"};
    return flat.fault();
  }

  /// Whether undistort() and the lens agree over the whole image, and neighbours stay neighbours.
  bool one_to_one() const {
    constexpr int steps = 32;
    std::vector<vec2> slope;
    for (int j = 0; j <= steps; ++j)
      for (int i = 0; i <= steps; ++i) {
        vec2 const image((static_cast<float>(i * width) / steps - flat.cx) / flat.fx,
                         (static_cast<float>(j * height) / steps - flat.cy) / flat.fy);
        vec2 const s = undistort(lens, image);
        double u, v;
        distort(lens, s.x, s.y, u, v);
        // An image point that no direction maps to, by a tenth of a pixel.
        if (!(std::abs(u - image.x) * flat.fx < 0.1 && std::abs(v - image.y) * flat.fy < 0.1)) return false;
        slope.push_back(s);
      }
    auto const at = [&](int i, int j) { return slope[static_cast<std::size_t>(j * (steps + 1) + i)]; };
    for (int j = 0; j < steps; ++j)
      for (int i = 0; i < steps; ++i) {
        vec2 const across = at(i + 1, j) - at(i, j), down = at(i, j + 1) - at(i, j);
        if (!(across.x * down.y - across.y * down.x > 0)) return false;
      }
    return true;
  }

 private:
  seen_slopes seen() const {
    return slopes_seen(flat, [this](vec2 const& p) { return undistort(lens, p); });
  }
};

static_assert(central_camera<opencv> && focal_camera<opencv>);

}}  // namespace gart::GART_ISA
