#pragma once
/// \file
/// Boxes of ellipsoids through a lens of any curve (camera/lens_curve.hpp). Let v be a direction in the ellipsoid's
/// middle; the silhouette in the plane across v is an ellipse, exactly. Let u be an image coordinate of a direction at
/// the angle d from v. Along u's gradient that direction lies in [a-, a+]. Then the coordinate is within
///   u(v) + |grad u| [a-, a+] +- K d^2 / 2,
/// K the largest second derivative of u up to that angle from the axis. With the Hessian H of u = r(theta) cos(phi),
///   r'' cos(phi),   -(r' - r cot(theta)) / sin(theta) sin(phi),   (r' cot(theta) - r / sin^2(theta)) cos(phi),
/// it is within the extremes of g s + s H s / 2 over that ellipse +- K3 d^3 / 6, K3 of third derivatives. This is a
/// quadratic over an ellipse, bounded by its dual.
///
/// Where an ellipsoid is seen large d^3 is too much. There a polygon is put about that ellipse. Where the lens folds
/// nowhere, u has a gradient everywhere. So it is largest on the polygon's border, whose edges are arcs. On an arc of
/// the angle l, u exceeds its values at the ends by at most K l^2 / 8.
///
/// Derivatives are tabulated (camera/lens_image.hpp). All is cut by the image of the ring and the sector that the
/// ellipsoid is seen in (camera/seen_angles.hpp). That image alone remains where the ellipsoid surrounds the camera or
/// reaches to where the lens says nothing. In double.

#include <gart/camera/lens_image.hpp>
#include <gart/camera/seen_angles.hpp>

#include <array>
#include <cmath>
#include <map>
#include <mutex>

namespace gart { inline namespace GART_ISA {

/// A lens with what its boxes need. Host side made, trivially copyable.
class lens_bounds : public lens_image {
 public:
  /// From a camera's size, focal lengths and principal point. It serves where neither a pose nor a near distance
  /// matters.
  using lens_image::lens_image;
  /// With a pose and a near distance.
  lens_bounds seen_from(mat3 const& rotation, float near) const {
    lens_bounds out = *this;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) out.to_camera_[i][j] = rotation[j][i];
    out.near_ = near;
    return out;
  }

  /// The pixels that can hit it, and its near depth; empty where none can.
  GART_HD footprint operator()(ellipsoid const& e) const {
    bool ignored = false;
    return box_of<true>(e, ignored);
  }
  /// The same where that takes no polygon; else nothing, and `wide` is set. Few take one, and it takes long, and
  /// registers that a kernel would have for all.
  GART_HD footprint narrow(ellipsoid const& e, bool& wide) const { return box_of<false>(e, wide); }

 private:
  static constexpr double wide_from = 0.18;  // silhouettes that reach less far are bounded by derivatives alone
  // Of the polygon round a silhouette, and of the angle of an edge and of half of it.
  static constexpr int edges = 16;
  static constexpr double edge_cosine = 0.92387953251128674, edge_sine = 0.38268343236508977,
                          half_edge_cosine = 0.98078528040323043;

  template <bool Polygon>
  GART_HD footprint box_of(ellipsoid const& e, bool& wide) const {
    constexpr double pi = 3.141592653589793;
    seen_ellipsoid const s(to_camera_, e);
    footprint out;
    out.depth = least_distance(e, near_);
    axial_range const range = angles_about_z(s, out.depth);
    if (range.lo > last_) return {};
    detail::interval u, v;
    double const lo = range.lo, hi = range.hi < last_ ? range.hi : last_;
    // The ring and the sector.
    double r_lo, r_hi, ignored;
    distance_at(lo, r_lo, ignored), distance_at(hi, r_hi, ignored);
    if (range.half >= pi) {
      u = {-r_hi, r_hi}, v = {-r_hi, r_hi};
    } else {
      double const from = range.middle - range.half, to = range.middle + range.half;
      for (double const phi : {from, to}) {
        double const c = cos(phi), n = sin(phi);
        u.add(r_lo * c), u.add(r_hi * c), v.add(r_lo * n), v.add(r_hi * n);
      }
      double const quarter = 0.5 * pi;
      for (double k = ceil(from / quarter); k * quarter < to; k += 1) {
        int const side = static_cast<int>(k) & 3;
        if (side == 0) u.add(r_hi);
        if (side == 2) u.add(-r_hi);
        if (side == 1) v.add(r_hi);
        if (side == 3) v.add(-r_hi);
      }
    }
    if (curve_.beside()) {
      double most_u, most_v;
      curve_.most_beside(curve_.after() ? r_hi : q_at(hi), most_u, most_v);
      u = {u.lo - most_u, u.hi + most_u}, v = {v.lo - most_v, v.hi + most_v};
    }
    cut_by_gradient<Polygon>(s, out.depth, u, v, wide);
    if (wide && !Polygon) return {};
    constexpr double pad = 0.01;
    out.box = {
        detail::first_pixel(fx_ * u.lo + cx_ - pad, width_), detail::first_pixel(fy_ * v.lo + cy_ - pad, height_),
        detail::first_pixel(fx_ * u.hi + cx_ + pad, width_), detail::first_pixel(fy_ * v.hi + cy_ + pad, height_)};
    if (out.box.empty()) return {};
    return out;
  }

  // u and v, in units of the focal lengths, cut by their bounds from the gradients at the centre.
  template <bool Polygon>
  GART_HD void cut_by_gradient(seen_ellipsoid const& s, double least, detail::interval& u, detail::interval& v,
                               bool& wide) const {
    vec3d const& m = s.center;
    if (!(s.distance > 0)) return;
    // About the middle of the silhouette across the centre's direction.
    vec3d w = m / s.distance;
    vec3d const side = fabs(w.x) < 0.6 ? vec3d(1, 0, 0) : vec3d(0, 1, 0), a1 = glm::normalize(glm::cross(side, w)),
                a2 = glm::cross(w, a1);
    flat_silhouette const first(s, a1, a2, w);
    if (!first.whole) return;
    w = glm::normalize(w + a1 * first.z1 + a2 * first.z2);
    double const across = sqrt(w.x * w.x + w.y * w.y), theta = atan2(across, w.z);
    bool const on_axis = !(across > 1e-9);
    double const cp = on_axis ? 1 : w.x / across, sp = on_axis ? 0 : w.y / across, cosine = w.z, sine = across;
    flat_silhouette const f(s, {cosine * cp, cosine * sp, -sine}, {-sp, cp, 0}, w);
    if (!f.whole) return;
    double const error = s.error / least, d = atan(sqrt(f.z1 * f.z1 + f.z2 * f.z2) + sqrt(f.major2())) + error;
    // Ellipsoids behind the camera have no such bound: the image has all of its outermost ring there.
    if (d > wide_from && theta + 1.02 * d < 3.1) {
      wide = true;
      if constexpr (Polygon)
        cut_by_polygon(f, {cosine * cp, cosine * sp, -sine}, {-sp, cp, 0}, w, error, u, v);
      else
        return;
    }
    if (!(theta + d < end())) return;
    double q, q_slope, value, by_square;
    curve_.curve(theta, q, q_slope);
    curve_.radial(q * q, value, by_square);
    double const r = q * value, r_slope = q_slope * (value + 2 * q * q * by_square);
    double const r_across = on_axis ? r_slope : r / sine, q_across = on_axis ? q_slope : q / sine;
    // Gradients along e1 and e2.
    double gx1 = r_slope * cp, gx2 = -r_across * sp, gy1 = r_slope * sp, gy2 = r_across * cp;
    double x = r * cp, y = r * sp;
    if (curve_.beside()) {
      bool const after = curve_.after();
      double const along = after ? r_slope : q_slope, beside = after ? r_across : q_across;
      double const bx1 = along * cp, bx2 = -beside * sp, by1 = along * sp, by2 = beside * cp;
      auto const t = after ? curve_.beside_at(x, y) : curve_.beside_at(q * cp, q * sp);
      gx1 += t.xx * bx1 + t.xy * by1, gx2 += t.xx * bx2 + t.xy * by2;
      gy1 += t.yx * bx1 + t.yy * by1, gy2 += t.yx * bx2 + t.yy * by2;
      x += t.x, y += t.y;
    }
    changes_up_to const by = changes(theta + d);
    // The error of bounds by gradients alone, and with second derivatives too, where these are as below.
    double const bend = 0.5 * d * d * by.second;
    bool const bent = sine > 1e-3 && d < 1.2;
    double const slope_s = tan(d), shrunk = d > 1e-4 ? 1 - d / slope_s : 1e-8;
    double const rest =
        d * d * (d * by.third / 6 + 0.5 * by.second_beside + 1e-6) + 0.5 * shrunk * slope_s * slope_s * by.second;
    double second = 0, mixed = 0, round = 0;
    if (bent) {
      constexpr double h = 1e-4;
      double before, after, ignored;
      distance_at(theta - h, ignored, before), distance_at(theta + h, ignored, after);
      second = (after - before) / (2 * h), mixed = (r_slope - r * cosine / sine) / sine;
      round = (r_slope * cosine - r / sine) / sine;
    }
    auto const cut = [&](detail::interval& to, double at, double g1, double g2, double cp_of, double sp_of) {
      double const middle = g1 * f.z1 + g2 * f.z2;
      double const half2 = g1 * g1 * f.h11 + 2 * g1 * g2 * f.h12 + g2 * g2 * f.h22;
      double const half = sqrt(half2 > 0 ? half2 : 0.0), turned = error * sqrt(g1 * g1 + g2 * g2);
      double lo = middle - half - bend, hi = middle + half + bend;
      if (bent) {
        // The silhouette is s = z + L y, |y| <= 1, on which u - u(v) = g s + s H s / 2.
        double const b11 = second * cp_of, b12 = -mixed * sp_of, b22 = round * cp_of;
        double const l11 = sqrt(f.h11) + 1e-300, l21 = f.h12 / l11, left = f.h22 - l21 * l21,
                     l22 = sqrt(left > 0 ? left : 0.0);
        double const w1 = g1 + b11 * f.z1 + b12 * f.z2, w2 = g2 + b12 * f.z1 + b22 * f.z2;
        double const base = middle + 0.5 * (b11 * f.z1 * f.z1 + 2 * b12 * f.z1 * f.z2 + b22 * f.z2 * f.z2);
        double const y1 = l11 * w1 + l21 * w2, y2 = l22 * w2;
        double const c11 = l11 * l11 * b11 + 2 * l11 * l21 * b12 + l21 * l21 * b22, c12 = l22 * (l11 * b12 + l21 * b22),
                     c22 = l22 * l22 * b22;
        double const most = base + most_on_disc(y1, y2, c11, c12, c22) + rest;
        double const fewest = base - most_on_disc(-y1, -y2, -c11, -c12, -c22) - rest;
        hi = most < hi ? most : hi, lo = fewest > lo ? fewest : lo;
      }
      lo += at - turned, hi += at + turned;
      to.lo = lo > to.lo ? lo : to.lo, to.hi = hi < to.hi ? hi : to.hi;
    };
    cut(u, x, gx1, gx2, cp, sp), cut(v, y, gy1, gy2, sp, -cp);
  }

  // Cuts u and v by their values on a polygon about the silhouette f, which lies across w.
  GART_HD void cut_by_polygon(flat_silhouette const& f, vec3d const& e1, vec3d const& e2, vec3d const& w, double error,
                              detail::interval& u, detail::interval& v) const {
    double const l11 = sqrt(f.h11), l21 = l11 > 0 ? f.h12 / l11 : 0.0, left = f.h22 - l21 * l21,
                 l22 = sqrt(left > 0 ? left : 0.0);
    double c = 1 / half_edge_cosine + 1e-9, n = 0;
    detail::interval x, y;
    vec3d before(0.0);
    place at{};
    GART_NO_UNROLL
    for (int k = 0; k <= edges; ++k) {
      vec3d d = w + e1 * (f.z1 + l11 * c) + e2 * (f.z2 + l21 * c + l22 * n);
      d = d / sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
      place const p = place_of(d);
      if (k > 0) {
        vec3d const step = d - before;
        double const chord2 = step.x * step.x + step.y * step.y + step.z * step.z;
        double const arc2 = chord2 * (1 + chord2 / 8),
                     most = (p.theta > at.theta ? p.theta : at.theta) + 0.5 * sqrt(arc2) + error;
        if (!(most < unfolded() && chord2 < 1.44)) return;
        changes_up_to const by = changes(most);
        double const rest = arc2 / 8 * by.second + error * by.first;
        x.add(at.x - rest), x.add(at.x + rest), y.add(at.y - rest), y.add(at.y + rest);
        x.add(p.x - rest), x.add(p.x + rest), y.add(p.y - rest), y.add(p.y + rest);
      }
      before = d, at = p;
      double const turned = c * edge_cosine - n * edge_sine;
      n = c * edge_sine + n * edge_cosine, c = turned;
    }
    u.lo = x.lo > u.lo ? x.lo : u.lo, u.hi = x.hi < u.hi ? x.hi : u.hi;
    v.lo = y.lo > v.lo ? y.lo : v.lo, v.hi = y.hi < v.hi ? y.hi : v.hi;
  }

  mat3d to_camera_{1.0};
  float near_ = 0;
};

/// Makes the bounds of a camera's lens. Tables take milliseconds, and views share lenses. So a program makes them once
/// a lens, and keeps the latest thousands. Host side.
inline lens_bounds tabulated_bounds(camera_kind kind, distortion const& l, float fx, float fy, float cx, float cy,
                                    int width, int height) {
  static std::mutex guard;
  static std::map<std::array<float, 25>, lens_bounds> known;
  std::array<float, 25> const key{static_cast<float>(kind),
                                  static_cast<float>(width),
                                  static_cast<float>(height),
                                  fx,
                                  fy,
                                  cx,
                                  cy,
                                  l.k1,
                                  l.k2,
                                  l.p1,
                                  l.p2,
                                  l.k3,
                                  l.k4,
                                  l.k5,
                                  l.k6,
                                  l.d1,
                                  l.d2,
                                  l.d3,
                                  l.s1,
                                  l.s2,
                                  l.s3,
                                  l.s4,
                                  l.omega,
                                  l.alpha,
                                  l.beta};
  std::lock_guard const lock(guard);
  if (auto const found = known.find(key); found != known.end()) return found->second;
  if (known.size() >= 4096) known.clear();
  return known.emplace(key, lens_bounds({kind, l}, fx, fy, cx, cy, width, height)).first->second;
}

}}  // namespace gart::GART_ISA
