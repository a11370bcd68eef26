#pragma once
// The ray of a pixel of any camera (scene/camera.hpp), in double, by the models' definitions. It inverts the lens's map
// of directions, by following it from the axis outwards.

#include <gart/core/error.hpp>
#include <gart/core/types.hpp>
#include <gart/scene/camera.hpp>

#include <cmath>
#include <complex>
#include <string>

namespace gart::by_definition {

// Origin relative to the camera's position; a direction of zeros where the lens gives none.
struct pixel_ray {
  vec3d origin{0.0}, direction{0.0};
};

// The map of a point (a, b) by a lens's polynomials, also of complex numbers. For a perspective lens a and b are
// slopes, for a fisheye angles.
template <class T>
void bend(distortion const& l, bool tangential_last, T a, T b, T& u, T& v) {
  T const r2 = a * a + b * b;
  double const k[] = {l.k1, l.k2, l.k3, l.k4, l.k5, l.k6}, d[] = {l.d1, l.d2, l.d3};
  T top = 1.0, under = 1.0, power = r2;
  for (int i = 0; i < 6; ++i, power *= r2) {
    top += k[i] * power;
    if (i < 3) under += d[i] * power;
  }
  T const x = a * top / under, y = b * top / under;
  if (tangential_last) a = x, b = y;
  T const s2 = a * a + b * b;
  double const p1 = l.p1, p2 = l.p2, s1 = l.s1, t1 = l.s2, s3 = l.s3, t3 = l.s4;
  u = x + 2.0 * p1 * a * b + p2 * (s2 + 2.0 * a * a) + s1 * s2 + t1 * s2 * s2;
  v = y + 2.0 * p2 * a * b + p1 * (s2 + 2.0 * b * b) + s3 * s2 + t3 * s2 * s2;
}

struct lens_point {
  double x, y;
  bool found;
};

// The point that is sent to (u, v), by Newton's method along the way from the axis. There the lens is the identity.
// Short steps keep it on the branch that begins there. Not found where that folds.
inline lens_point unbent(distortion const& l, bool tangential_last, double u, double v) {
  if (!l.any()) return {u, v, true};
  using complex = std::complex<double>;
  constexpr int steps = 24;
  constexpr double h = 1e-30;
  double x = 0, y = 0;
  for (int step = 1; step <= steps; ++step) {
    double const to_u = u * step / steps, to_v = v * step / steps;
    double error = 1;
    for (int i = 0; i < 50 && error > 1e-15; ++i) {
      complex by_x_u, by_x_v, by_y_u, by_y_v;
      bend<complex>(l, tangential_last, {x, h}, {y, 0}, by_x_u, by_x_v);
      bend<complex>(l, tangential_last, {x, 0}, {y, h}, by_y_u, by_y_v);
      double const xx = by_x_u.imag() / h, xy = by_y_u.imag() / h, yx = by_x_v.imag() / h, yy = by_y_v.imag() / h;
      double const det = xx * yy - xy * yx, eu = by_x_u.real() - to_u, ev = by_x_v.real() - to_v;
      if (!(det > 0)) return {x, y, false};
      double const dx = (eu * yy - ev * xy) / det, dy = (ev * xx - eu * yx) / det;
      x -= dx, y -= dy;
      error = (std::abs(dx) + std::abs(dy)) / (1 + std::abs(x) + std::abs(y));
      if (!std::isfinite(error)) return {x, y, false};
    }
    if (error > 1e-13) return {x, y, false};
  }
  return {x, y, true};
}

// In the camera's axes, of any length; false without one.
inline bool direction_in_camera(camera const& c, double u, double v, vec3d& out) {
  constexpr double pi = 3.14159265358979323846;
  if (c.kind == camera_kind::equirectangular) {
    double const azimuth = 2 * pi * (u / c.width - 0.5), height = pi * (v / c.height - 0.5);
    out = {std::cos(height) * std::sin(azimuth), std::sin(height), std::cos(height) * std::cos(azimuth)};
    return true;
  }
  distortion const& l = c.lens;
  distortion tangential = l;  // the kinds with a curve of their own have no radial terms besides
  if (c.kind == camera_kind::fov || c.kind == camera_kind::eucm || c.kind == camera_kind::division)
    tangential.k1 = tangential.k2 = tangential.k3 = tangential.k4 = tangential.k5 = tangential.k6 = tangential.d1 =
        tangential.d2 = tangential.d3 = 0;
  lens_point const p = unbent(tangential, c.kind == camera_kind::fisheye624, (u - c.cx) / c.fx, (v - c.cy) / c.fy);
  if (!p.found) return false;
  double const q = std::hypot(p.x, p.y), x = q > 0 ? p.x / q : 1, y = q > 0 ? p.y / q : 0;
  double across = q, along = 1;  // of the direction, at that distance from the axis
  switch (c.kind) {
    case camera_kind::fov: {
      double const angle = q * l.omega;
      across = std::sin(angle), along = 2 * std::tan(0.5 * l.omega) * std::cos(angle);
      if (!(angle < pi)) return false;
      break;
    }
    case camera_kind::eucm: {
      // From q (alpha rho + (1 - alpha) z) = across with rho^2 = beta across^2 + z^2, across taken as q.
      double const a = l.alpha, b = l.beta, inner = 1 - (2 * a - 1) * b * q * q;
      if (!(inner >= 0)) return false;
      along = (1 - b * a * a * q * q) / (a * std::sqrt(inner) + 1 - a);
      break;
    }
    case camera_kind::division:
      along = 1 + l.k1 * q * q;
      if (!(1 - l.k1 * q * q > 0)) return false;
      break;
    case camera_kind::fisheye:
    case camera_kind::fisheye624:
      if (!(q < pi)) return false;
      across = std::sin(q), along = std::cos(q);
      break;
    default:
      break;
  }
  out = {across * x, across * y, along};
  return true;
}

// v turned by the vector w, |w| its angle.
inline vec3d turned_by(vec3d const& w, vec3d const& v) {
  auto const cross = [](vec3d const& a, vec3d const& b) {
    return vec3d(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  };
  double const angle = std::sqrt(w.x * w.x + w.y * w.y + w.z * w.z);
  if (angle == 0) return v;
  vec3d const axis = w / angle, once = cross(axis, v);
  return v + std::sin(angle) * once + (1 - std::cos(angle)) * cross(axis, once);
}

inline vec3d in_world(camera const& c, vec3d const& v) {
  vec3d out(0.0);
  for (int axis = 0; axis < 3; ++axis)
    for (int k = 0; k < 3; ++k) out[k] += static_cast<double>(c.rotation[axis][k]) * v[axis];
  return out;
}

// Throws invalid_argument for a lens of OpenCV's four terms that cannot be inverted there.
inline pixel_ray ray_of(camera const& c, u32 pixel) {
  u32 const width = static_cast<u32>(c.width);
  double const u = pixel % width + 0.5, v = pixel / width + 0.5;
  if (c.kind == camera_kind::orthographic)
    return {in_world(c, {(u - c.cx) / c.fx, (v - c.cy) / c.fy, 0}), in_world(c, {0, 0, 1})};
  vec3d d(0.0), origin(0.0);
  if (!direction_in_camera(c, u, v, d)) {
    if (c.kind != camera_kind::perspective || c.lens.more()) return {};
    throw invalid_argument("reference: the lens cannot be inverted at pixel (" + std::to_string(pixel % width) + ", " +
                           std::to_string(pixel / width) + "); leave it out, or undistort the capture");
  }
  if (c.shutter != shutter_kind::global) {
    // The pose is that of the middle of the read-out, -1/2 and 1/2 its ends.
    bool const columns = c.shutter == shutter_kind::left_to_right || c.shutter == shutter_kind::right_to_left;
    bool const backwards = c.shutter == shutter_kind::bottom_to_top || c.shutter == shutter_kind::right_to_left;
    double time = columns ? u / c.width - 0.5 : v / c.height - 0.5;
    if (backwards) time = -time;
    d = turned_by(time * vec3d(c.turn), d), origin = in_world(c, time * vec3d(c.travel));
  }
  d = in_world(c, d);
  return {origin, d / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z)};
}

}  // namespace gart::by_definition
