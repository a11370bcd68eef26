#pragma once
// Footprints for a camera, its lens included. A pinhole's are math/footprint.hpp's. Through a distorted lens the
// rectangle of slopes that bounds the ellipsoid is mapped to the image edge by edge: the map is one to one where the
// image is, so the image of the rectangle lies within the image of its border, which is sampled and widened by what a
// curved edge can bulge between samples.

#include <gart/math/footprint.hpp>
#include <gart/scene/seen_slopes.hpp>

namespace gart {

class camera_footprint {
 public:
  // Host side: the bounds of what the image sees, in slopes, by sampling its border. invalid_argument for a camera or a
  // near distance that have none.
  camera_footprint(camera const& c, float near) : lens_(c.lens), fx_(c.fx), fy_(c.fy), cx_(c.cx), cy_(c.cy) {
    require_camera(c);
    if (!(near > 0 && is_finite(near))) throw invalid_argument("footprints: near must be positive and finite");
    mat3d world_to_camera(1.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) world_to_camera[i][j] = c.rotation[j][i];
    seen_slopes const seen = slopes_seen(c);
    // The border between samples may bulge a little further.
    double const margin = c.lens.any() ? 0.02 : 0.0;
    double const mu = margin * (seen.x1 - seen.x0), mw = margin * (seen.y1 - seen.y0);
    u_ = {seen.x0 - mu, seen.x1 + mu}, w_ = {seen.y0 - mw, seen.y1 + mw};
    view_ = {world_to_camera, fx_, fy_, cx_, cy_, c.width, c.height, near * seen.least_cosine * (1 - margin)};
  }

  template <class Response = generalized_gaussian<>>
  GART_HD footprint operator()(gaussian_parameters const& g, vec3d const& frame, float alpha_min) const {
    slope_box s;
    footprint out = gaussian_slopes<Response>(view_, g, frame, alpha_min, s);
    if (!s.visible) return {};
    if (lens_.any()) s = distorted(s);
    out.box = pixels_of(view_, s);
    return out;
  }

 private:
  GART_HD slope_box distorted(slope_box const& s) const {
    auto const clamp = [](double v, detail::interval const& to) { return v < to.lo ? to.lo : v > to.hi ? to.hi : v; };
    // What lies outside the view is seen by no pixel; keeping the rectangle to it keeps it where the lens is one to
    // one.
    double const x0 = clamp(s.u.lo, u_), x1 = clamp(s.u.hi, u_), y0 = clamp(s.w.lo, w_), y1 = clamp(s.w.hi, w_);
    detail::interval u, v;
    constexpr int steps = 4;
    // A loop: unrolled, a lens would take the registers of cameras without one.
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
    // Second derivatives of the lens along an edge are at most this on the rectangle; a chord of length h bulges h^2 /
    // 8 times as much.
    double const rx = fabs(x0) > fabs(x1) ? fabs(x0) : fabs(x1), ry = fabs(y0) > fabs(y1) ? fabs(y0) : fabs(y1);
    double const r = sqrt(rx * rx + ry * ry);
    double const curvature = 6 * (fabs(double{lens_.k1}) * r + fabs(double{lens_.p1}) + fabs(double{lens_.p2})) +
                             20 * fabs(double{lens_.k2}) * r * r * r;
    double const hx = (x1 - x0) / steps, hy = (y1 - y0) / steps;
    double const bulge = curvature * (hx * hx + hy * hy) / 8;
    slope_box out = s;
    out.u = {u.lo - bulge, u.hi + bulge}, out.w = {v.lo - bulge, v.hi + bulge};
    return out;
  }

  distortion lens_;
  double fx_, fy_, cx_, cy_;
  detail::interval u_, w_;  // slopes the image sees
  footprint_view view_;
};

}  // namespace gart
