#pragma once
/// \file
/// The radial-tangential lens (camera/opencv.hpp), there and back.

#include <gart/math/arith.hpp>
#include <gart/math/lanes.hpp>
#include <gart/scene/camera.hpp>

namespace gart { inline namespace GART_ISA {

/// The image point of the slopes x = X/Z and y = Y/Z, in focal lengths from the principal point.
GART_HD inline void distort(distortion const& lens, double x, double y, double& u, double& v) {
  double const r2 = x * x + y * y, radial = 1 + r2 * (lens.k1 + r2 * lens.k2);
  u = x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x);
  v = y * radial + 2 * lens.p2 * x * y + lens.p1 * (r2 + 2 * y * y);
}

/// Newton's method on the distortion; exact to float after a few steps for lenses that are invertible at the point. F:
/// of one point, or of one a lane.
template <class F>
GART_HD GART_INLINE void undistort(distortion const& lens, F u, F v, F& x, F& y) {
  F const k1 = lens.k1, k2 = lens.k2, lens_p1 = lens.p1, lens_p2 = lens.p2;
  F const p1 = mul(F(2.0f), lens_p1), p2 = mul(F(2.0f), lens_p2);
  x = u, y = v;
  auto going = F(0.0f) <= F(0.0f);
  for (int i = 0; i < 10; ++i) {
    F const xx = mul(x, x), yy = mul(y, y), xy = mul(x, y), r2 = add(xx, yy);
    F const radial = fma(r2, fma(r2, k2, k1), F(1.0f));
    F const slope = fma(mul(F(4.0f), k2), r2, mul(F(2.0f), k1));  // d radial / d x = slope * x
    F const ex = add(fma(x, radial, fma(p1, xy, mul(lens_p2, fma(F(2.0f), xx, r2)))), -u);
    F const ey = add(fma(y, radial, fma(p2, xy, mul(lens_p1, fma(F(2.0f), yy, r2)))), -v);
    F const by_xx = fma(slope, xx, fma(p1, y, fma(mul(F(3.0f), p2), x, radial)));
    F const by_xy = fma(slope, xy, fma(p1, x, mul(p2, y)));
    F const by_yy = fma(slope, yy, fma(p2, x, fma(mul(F(3.0f), p1), y, radial)));
    F const det = fma(by_xx, by_yy, -mul(by_xy, by_xy));
    // Where the lens folds there is nowhere to go.
    auto const folds = det == F(0.0f);
    F const dx = select(folds, F(0.0f), divide(fma(ex, by_yy, -mul(ey, by_xy)), det));
    F const dy = select(folds, F(0.0f), divide(fma(ey, by_xx, -mul(ex, by_xy)), det));
    x = select(going, add(x, -dx), x), y = select(going, add(y, -dy), y);
    // The next step would be of the order of this one's square.
    going = both(going, fma(dx, dx, mul(dy, dy)) >= F(1e-10f));
    if (!any(going)) break;
  }
}

/// The slopes of one image point.
GART_HD inline vec2 undistort(distortion const& lens, vec2 distorted) {
  vec2 p;
  undistort(lens, distorted.x, distorted.y, p.x, p.y);
  return p;
}

}}  // namespace gart::GART_ISA
