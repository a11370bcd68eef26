#pragma once
/// \file
/// The angles under which a camera sees an ellipsoid m + A s, |s| <= 1. They follow from its centre m and covariance C
/// = A A^T in the camera's axes. The boxes of lenses and of the sphere are made of these. In a plane through the camera
/// the ellipsoid is an ellipse with two exact tangents. About an axis there are first the angles round it, then those
/// with it.
///
/// All in double. C is widened by a ten millionth of the reach: flat ellipsoids keep an inside, and nothing cancels.

#include <gart/math/footprint.hpp>

namespace gart { inline namespace GART_ISA {

/// Six numbers of a symmetric matrix.
struct covariance {
  double xx, xy, xz, yy, yz, zz;  ///< its entries

  /// a^T C b.
  GART_HD double between(vec3d const& a, vec3d const& b) const {
    vec3d const r = times(b);
    return a.x * r.x + a.y * r.y + a.z * r.z;
  }
  /// C b.
  GART_HD vec3d times(vec3d const& b) const {
    return {xx * b.x + xy * b.y + xz * b.z, xy * b.x + yy * b.y + yz * b.z, xz * b.x + yz * b.y + zz * b.z};
  }
  /// det(C) C^-1 b.
  GART_HD vec3d adjugate_times(vec3d const& b) const {
    double const a = yy * zz - yz * yz, d = xz * yz - xy * zz, e = xy * yz - xz * yy, f = xx * zz - xz * xz,
                 g = xy * xz - xx * yz, h = xx * yy - xy * xy;
    return {a * b.x + d * b.y + e * b.z, d * b.x + f * b.y + g * b.z, e * b.x + g * b.y + h * b.z};
  }
};

/// An ellipsoid in the axes of a camera.
struct seen_ellipsoid {
  vec3d center;     ///< m
  covariance c;     ///< of A, a little widened
  double distance;  ///< |m|
  double reach;     ///< how far it goes from the camera, at most
  double error;     ///< how far rounding may move a hit, world units

  /// to_camera: world to camera.
  GART_HD seen_ellipsoid(mat3d const& to_camera, ellipsoid const& e) {
    center = to_camera * e.center;
    mat3d const a = to_camera * e.axes;
    auto const sum = [&](int i, int j) { return a[0][i] * a[0][j] + a[1][i] * a[1][j] + a[2][i] * a[2][j]; };
    c = {sum(0, 0), sum(0, 1), sum(0, 2), sum(1, 1), sum(1, 2), sum(2, 2)};
    distance = sqrt(center.x * center.x + center.y * center.y + center.z * center.z);
    reach = distance + sqrt(c.xx + c.yy + c.zz);
    error = rounding_of_hits * (fabs(e.center.x) + fabs(e.center.y) + fabs(e.center.z) + 2 * (reach - distance));
    double const widen = 1e-7 * reach;
    c.xx += widen * widen, c.yy += widen * widen, c.zz += widen * widen;
  }
};

/// The ellipse of an ellipsoid's silhouette in the plane across a direction v, at the distance 1. It has its middle and
/// the matrix of its squared half-widths, along two axes there.
struct flat_silhouette {
  double z1 = 0, z2 = 0;             ///< the middle
  double h11 = 0, h12 = 0, h22 = 0;  ///< half-widths squared
  bool whole = false;                ///< false: the ellipsoid does not lie in front of the camera, towards v

  flat_silhouette() = default;
  /// Of three axes across each other.
  GART_HD flat_silhouette(seen_ellipsoid const& e, vec3d const& e1, vec3d const& e2, vec3d const& v) {
    auto const dot = [](vec3d const& a, vec3d const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
    vec3d const along = e.c.times(v);
    double const m = dot(e.center, v), m1 = dot(e.center, e1), m2 = dot(e.center, e2), front = m * m - dot(along, v);
    whole = m > 0 && front > 1e-12 * e.distance * e.distance;
    if (!whole) return;
    z1 = (m1 * m - dot(along, e1)) / front, z2 = (m2 * m - dot(along, e2)) / front;
    h11 = z1 * z1 - (m1 * m1 - e.c.between(e1, e1)) / front, h22 = z2 * z2 - (m2 * m2 - e.c.between(e2, e2)) / front;
    h12 = z1 * z2 - (m1 * m2 - e.c.between(e1, e2)) / front;
    h11 = h11 > 0 ? h11 : 0, h22 = h22 > 0 ? h22 : 0;
  }
  /// The square of its longest half-width.
  GART_HD double major2() const { return 0.5 * (h11 + h22) + sqrt(0.25 * (h11 - h22) * (h11 - h22) + h12 * h12); }
};

/// At least b y + y C y / 2 of all |y| <= 1: its Lagrangian dual, all but at the best multiplier.
GART_HD inline double most_on_disc(double b1, double b2, double c11, double c12, double c22) {
  double const length = sqrt(b1 * b1 + b2 * b2);
  double const largest = 0.5 * (c11 + c22) + sqrt(0.25 * (c11 - c22) * (c11 - c22) + c12 * c12);
  double along = 0;
  if (length > 0) along = (b1 * b1 * c11 + 2 * b1 * b2 * c12 + b2 * b2 * c22) / (length * length);
  double const wanted = length + along, floor_at = (largest > 0 ? largest : 0.0) + 0.05 * length + 1e-300;
  double const m = wanted > floor_at ? wanted : floor_at;
  double const a = m - c11, d = m - c22, det = a * d - c12 * c12;
  if (!(length > 0)) return 0.5 * m;
  if (!(det > 0)) return 1e300;
  return 0.5 * ((b1 * b1 * d + 2 * b1 * b2 * c12 + b2 * b2 * a) / det + m);
}

/// Angles from one to another.
struct angle_range {
  double lo, hi;     ///< radians, against the middle's direction
  bool all = false;  ///< every angle: the ellipse holds the camera
};

/// In the plane of two orthogonal unit vectors. Angles count from the centre's own direction there, from the first
/// vector towards the second. With the ellipse's centre (a, b) and covariance C the tangents are
///   sqrt(Q - det C) m +- J adj(C) m,   Q = m^T adj(C) m, J a quarter turn.
GART_HD inline angle_range angles_in_plane(double a, double b, double aa, double ab, double bb) {
  double const det = aa * bb - ab * ab, square = a * a + b * b;
  double const q = bb * a * a - 2 * ab * a * b + aa * b * b;
  if (!(q > det)) return {0, 0, true};
  double const along = sqrt(q - det) * square, skew = ab * (a * a - b * b) + a * b * (bb - aa);
  return {-atan2(q, along - skew), atan2(q, along + skew), false};
}

/// About the camera's axis z: the angles round it, from x towards y, and with it.
struct axial_range {
  double middle, half;  ///< round the axis: middle +- half; half >= pi: all the way
  double lo, hi;        ///< with the axis, 0 to pi
};

/// turned: the axes that the ellipsoid is in. Conservative for directions that are off by `error` over `least`, the
/// distance of the nearest hit.
GART_HD inline axial_range angles_about_z(seen_ellipsoid const& e, double least) {
  constexpr double pi = 3.141592653589793;
  vec3d const& m = e.center;
  covariance const& c = e.c;
  double const error = e.error / least;
  axial_range out{0, 2 * pi, 0, pi};
  if (!(error < 0.5)) return out;
  // How far from the axis the silhouette goes where it lies on one side of the camera.
  for (int side = -1; side <= 1; side += 2) {
    flat_silhouette const f(e, {1, 0, 0}, {0, 1, 0}, {0, 0, static_cast<double>(side)});
    if (!f.whole) continue;
    double const l11 = sqrt(f.h11) + 1e-300, l21 = f.h12 / l11, left = f.h22 - l21 * l21,
                 l22 = sqrt(left > 0 ? left : 0.0);
    double const far2 =
        f.z1 * f.z1 + f.z2 * f.z2 +
        2 * most_on_disc(l11 * f.z1 + l21 * f.z2, l22 * f.z2, l11 * l11 + l21 * l21, l21 * l22, l22 * l22);
    double const far = atan(sqrt(far2)) * (1 + 1e-9) + error;
    (side > 0 ? out.hi : out.lo) = side > 0 ? far : pi - far;
  }
  angle_range const round = angles_in_plane(m.x, m.y, c.xx, c.xy, c.yy);
  if (round.all) {
    // Hits lie in front of the camera as the ellipsoid's own axes have it.
    vec3d const n = c.adjugate_times(m);
    double const beside = sqrt(n.x * n.x + n.y * n.y), tilt = atan2(beside, n.z), quarter = 0.5 * pi + 1e-3 + error;
    if (beside + fabs(n.z) > 0) {
      out.lo = tilt - quarter > out.lo ? tilt - quarter : out.lo;
      out.hi = tilt + quarter < out.hi ? tilt + quarter : out.hi;
    }
    return out;
  }
  double const own = atan2(m.y, m.x);
  out.middle = own + 0.5 * (round.lo + round.hi);
  double const half = 0.5 * (round.hi - round.lo);
  double const hx = cos(out.middle), hy = sin(out.middle), h = hx * m.x + hy * m.y;
  double const zh = c.xz * hx + c.yz * hy, hh = c.xx * hx * hx + 2 * c.xy * hx * hy + c.yy * hy * hy;
  angle_range const with = angles_in_plane(m.z, h, c.zz, zh, hh);
  if (with.all) return out;
  double const theta = atan2(h, m.z), lo = theta + with.lo, hi = theta + with.hi;
  // Where the plane through the axis turns by `half` the angle with the axis is another.
  double const turned = cos(half);
  double const lo_turned = atan2(sin(lo), turned * cos(lo)), hi_turned = atan2(sin(hi), turned * cos(hi));
  double const nearest = (lo < lo_turned ? lo : lo_turned) - error,
               farthest = (hi > hi_turned ? hi : hi_turned) + error;
  out.lo = nearest > out.lo ? nearest : out.lo, out.hi = farthest < out.hi ? farthest : out.hi;
  double const sine_lo = sin(out.lo), sine_hi = sin(out.hi), sine = sine_lo < sine_hi ? sine_lo : sine_hi;
  out.half = error < sine ? half + asin(error / sine) : 2 * pi;
  return out;
}

}}  // namespace gart::GART_ISA
