#pragma once
/// \file
/// Where on the image a Gaussian can be hit. A camera bounds its ellipsoid |p|^2 <= cutoff (camera/model.hpp). For a
/// pinhole the bounds are perspective-correct.
///
/// In camera space the ellipsoid is m + A s, |s| <= 1. A = c W R S, with c^2 the cutoff and rows A_x, A_y, A_z. Planes
/// x = u z through the camera touch it where (m_x - u m_z)^2 = |A_x - u A_z|^2, a quadratic in u. When the ellipsoid
/// lies in front of the camera, the roots bound x / z. They are the paper's centre p and half-extent h in another form.
/// When it crosses the near plane z = n only the part in front counts. A root is a bound if it touches at z >= n. The
/// ellipse that the near plane cuts out gives the others. So a Gaussian beside or around the camera gets the box of its
/// visible part, and no more.
///
/// All in double: the quadratic of a small far ellipsoid cancels to a few digits in float. The box is then widened by a
/// hundredth of a pixel, and by a hit's movement in float arithmetic. The latter is 32 roundings of the distance. No
/// pixel that hits lies outside.

#include <gart/math/ray_gaussian.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// Half-open: pixels x0 <= x < x1, y0 <= y < y1. Images go to 65535 a side.
struct pixel_box {
  u16 x0 = 0, y0 = 0, x1 = 0, y1 = 0;  ///< pixels
  /// Whether no pixel lies in it.
  GART_HD constexpr bool empty() const { return x1 <= x0 || y1 <= y0; }
  /// In pixels.
  GART_HD constexpr u32 width() const { return empty() ? 0u : u32{x1} - x0; }
  /// In pixels.
  GART_HD constexpr u32 height() const { return empty() ? 0u : u32{y1} - y0; }
  /// How many pixels lie in it.
  GART_HD constexpr u32 area() const { return width() * height(); }
};

/// Where a Gaussian can be hit.
struct footprint {
  pixel_box box;    ///< empty where it cannot be
  float depth = 0;  ///< no hit has a smaller one, along what its camera measures depth: conservative near depth
  /// For an image whose right border goes on at its left one. Where the box passes that border it is the image's width.
  /// The box's columns from there on are the image's from 0 on. Else 0. Such a box leaves out seam_room columns or
  /// more.
  u16 seam = 0;

  static constexpr int seam_room = 32;  ///< as wide as the widest tile: no tile holds both ends of a box
};

/// How far float arithmetic may move a hit, by the distance: 32 roundings.
inline constexpr double rounding_of_hits = 4e-6;

/// m + A s, |s| <= 1, in world axes; m relative to the camera's centre.
struct ellipsoid {
  vec3d center;  ///< m
  mat3d axes;    ///< A
};

/// Where the Gaussian can be hit: A = c R S, c^2 the cutoff. False where nowhere.
template <class Response = generalized_gaussian<>>
GART_HD inline bool ellipsoid_of(gaussian_parameters const& g, vec3d const& frame, float alpha_min, ellipsoid& out) {
  float const cutoff = hit_cutoff<Response>(g, alpha_min);
  if (cutoff < 0) return false;
  mat3 const rotation = to_matrix(g.rotation);
  vec3 const scale = scale_of(g);
  double const c = sqrt(static_cast<double>(cutoff));
  for (int k = 0; k < 3; ++k) out.axes[k] = vec3d(rotation[k]) * (c * static_cast<double>(scale[k]));
  out.center = vec3d(g.mean) - frame;
  return true;
}

/// By the bounds of a camera model.
template <class Response = generalized_gaussian<>, class Bounds>
GART_HD inline footprint footprint_of(Bounds const& bounds, gaussian_parameters const& g, vec3d const& frame,
                                      float alpha_min) {
  ellipsoid e;
  return ellipsoid_of<Response>(g, frame, alpha_min, e) ? bounds(e) : footprint{};
}

/// No hit at t > near is nearer to the camera's centre. For the ellipsoid lies beyond the plane across its own
/// direction.
GART_HD inline float least_distance(ellipsoid const& e, float near) {
  vec3d const& m = e.center;
  double const distance = sqrt(m.x * m.x + m.y * m.y + m.z * m.z);
  double half2 = 0, reach = 0;
  for (int k = 0; k < 3; ++k) {
    vec3d const& a = e.axes[k];
    double const along = a.x * m.x + a.y * m.y + a.z * m.z;
    half2 += along * along;
    reach += fabs(m[k]) + fabs(a.x) + fabs(a.y) + fabs(a.z);
  }
  double const least = distance > 0 ? distance - sqrt(half2) / distance - rounding_of_hits * reach : 0;
  return static_cast<float>((least > near ? least : near) * (1 - 1e-6));
}

/// The pinhole a footprint is for.
struct footprint_view {
  mat3d to_camera;        ///< world to camera rotation
  double fx, fy, cx, cy;  ///< focal lengths and principal point, pixels
  int width, height;      ///< pixels
  double near;            ///< smallest z of a hit: the ray's near distance times the least cosine of a pixel
};

namespace detail {

struct interval {
  double lo = 1e300, hi = -1e300;
  GART_HD void add(double v) {
    lo = v < lo ? v : lo;
    hi = v > hi ? v : hi;
  }
};

// Bounds of x / z over the part of the ellipsoid with z >= n. (mx, ax): centre and row of the axis; (mz, az): of depth.
GART_HD inline interval slope_bounds(double mx, vec3d const& ax, double mz, vec3d const& az, double n) {
  auto const dot = [](vec3d const& a, vec3d const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  double const zz = dot(az, az), xz = dot(ax, az), xx = dot(ax, ax);
  interval out;
  double const depth = sqrt(zz);
  bool const crosses = mz - depth < n;
  // Tangents, in slopes relative to the centre's where the centre lies in front: there nothing cancels.
  double const base = mz > depth ? mx / mz : 0.0;
  vec3d const bx = ax - base * az;
  double const b0 = mx - base * mz;  // zero but for rounding where base is the centre's slope
  double const qa = (mz - depth) * (mz + depth);
  double const qb = b0 * mz - dot(bx, az);
  double const qc = (b0 - sqrt(dot(bx, bx))) * (b0 + sqrt(dot(bx, bx)));
  double const discriminant = qb * qb - qa * qc;
  // In front of the camera there are tangents: a negative discriminant is rounding. A crossing ellipsoid may have none.
  if (discriminant >= 0 || !crosses) {
    double const root = sqrt(discriminant > 0 ? discriminant : 0.0);
    double const q = qb >= 0 ? qb + root : qb - root;
    double const slopes[2] = {q / qa, q != 0 ? qc / q : 0.0};
    for (double const u : slopes) {
      vec3d const normal = bx - u * az;
      double const offset = b0 - u * mz, length2 = dot(normal, normal);
      double const z = length2 > 0 ? mz - offset * dot(normal, az) / length2 : mz;
      if (!crosses || z >= n) out.add(base + u);
    }
  }
  if (crosses && zz > 0) {
    // The section with z = n: centre and half-width of its x.
    double const e = n - mz;
    double const share = 1 - e * e / zz;
    double const across2 = xx - xz * xz / zz;
    double const half = share > 0 && across2 > 0 ? sqrt(share * across2) : 0.0;
    double const center = mx + xz * e / zz;
    out.add((center - half) / n);
    out.add((center + half) / n);
  }
  return out;
}

GART_HD inline u16 first_pixel(double edge, int size) {
  double const p = ceil(edge - 0.5);
  return static_cast<u16>(p <= 0 ? 0 : p >= size ? size : p);
}

}  // namespace detail

/// Bounds in slopes x / z and y / z, with the error to widen them by.
struct slope_box {
  detail::interval u, w;  ///< x / z and y / z
  double error = 0;       ///< in slopes
  bool visible = false;   ///< whether any of it can be hit
};

/// An ellipsoid in the camera's axes.
struct camera_ellipsoid {
  vec3d m;           ///< centre
  vec3d ax, ay, az;  ///< rows of A
  GART_HD camera_ellipsoid(footprint_view const& v, ellipsoid const& e) : m(v.to_camera * e.center) {
    mat3d const a = v.to_camera * e.axes;
    ax = vec3d(a[0][0], a[1][0], a[2][0]), ay = vec3d(a[0][1], a[1][1], a[2][1]), az = vec3d(a[0][2], a[1][2], a[2][2]);
  }
};

/// Sets the footprint's depth only.
GART_HD inline footprint project(footprint_view const& v, ellipsoid const& e, slope_box& s) {
  footprint out;
  vec3d const& center = e.center;
  camera_ellipsoid const seen(v, e);
  vec3d const &m = seen.m, &ax = seen.ax, &ay = seen.ay, &az = seen.az;
  double const depth = sqrt(az.x * az.x + az.y * az.y + az.z * az.z);
  double const reach = fabs(center.x) + fabs(center.y) + fabs(center.z) + depth +
                       sqrt(ax.x * ax.x + ax.y * ax.y + ax.z * ax.z) + sqrt(ay.x * ay.x + ay.y * ay.y + ay.z * ay.z);
  double const error = rounding_of_hits * reach;
  if (!(m.z + depth + error >= v.near)) return out;
  double const nearest = m.z - depth - error > v.near ? m.z - depth - error : v.near;
  s.u = detail::slope_bounds(m.x, ax, m.z, az, v.near);
  s.w = detail::slope_bounds(m.y, ay, m.z, az, v.near);
  s.error = error / nearest;
  s.visible = true;
  out.depth = static_cast<float>(nearest * (1 - 1e-6));
  return out;
}

/// The pixels between these slopes, of the image.
GART_HD inline pixel_box pixels_of(footprint_view const& v, slope_box const& s) {
  double const pad_x = 0.01 + v.fx * s.error, pad_y = 0.01 + v.fy * s.error;
  pixel_box const out{detail::first_pixel(v.fx * s.u.lo + v.cx - pad_x, v.width),
                      detail::first_pixel(v.fy * s.w.lo + v.cy - pad_y, v.height),
                      detail::first_pixel(v.fx * s.u.hi + v.cx + pad_x, v.width),
                      detail::first_pixel(v.fy * s.w.hi + v.cy + pad_y, v.height)};
  return out.empty() ? pixel_box{} : out;
}

}}  // namespace gart::GART_ISA
