#pragma once
// One camera of each model that is not a pinhole, and where each has a direction, in double and straight from the
// model's definition: what rays and boxes are held against.

#include <gart/camera/models.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace gart_test {

struct named_lens {
  char const* name;
  gart::camera_kind kind;
  double focal;       // over the image's side
  double half_angle;  // of what is seen, at least, for drawing ellipsoids
  gart::distortion lens;
};

inline std::vector<named_lens> const& lenses() {
  using kind = gart::camera_kind;
  static std::vector<named_lens> const all = [] {
    std::vector<named_lens> out;
    auto const add = [&](char const* name, kind k, double focal, double half_angle) -> gart::distortion& {
      out.push_back({name, k, focal, half_angle, {}});
      return out.back().lens;
    };
    add("SIMPLE_FISHEYE", kind::fisheye, 0.17, 2.8);
    auto& kb = add("OPENCV_FISHEYE", kind::fisheye, 0.3, 1.9);
    kb.k1 = -0.02f, kb.k2 = 0.008f, kb.k3 = -0.003f, kb.k4 = 0.0004f;
    auto& radial = add("RADIAL_FISHEYE", kind::fisheye, 0.3, 1.6);
    radial.k1 = 0.03f, radial.k2 = -0.01f;
    auto& prism = add("THIN_PRISM_FISHEYE", kind::fisheye, 0.3, 1.5);
    prism.k1 = -0.03f, prism.k2 = 0.01f, prism.p1 = 0.003f, prism.p2 = -0.002f, prism.k3 = -0.002f, prism.k4 = 0.0003f,
    prism.s1 = 0.002f, prism.s3 = -0.003f;
    auto& aria = add("RAD_TAN_THIN_PRISM_FISHEYE", kind::fisheye624, 0.3, 1.5);
    aria.k1 = -0.02f, aria.k2 = 0.01f, aria.k3 = -0.004f, aria.k4 = 0.001f, aria.k5 = -2e-4f, aria.k6 = 1e-5f;
    aria.p1 = 0.001f, aria.p2 = -0.002f, aria.s1 = 0.001f, aria.s2 = -3e-4f, aria.s3 = 0.002f, aria.s4 = -2e-4f;
    add("FOV", kind::fov, 0.35, 1.7).omega = 1.1f;
    auto& eucm = add("EUCM", kind::eucm, 0.3, 1.7);
    eucm.alpha = 0.62f, eucm.beta = 1.1f;
    add("DIVISION", kind::division, 0.4, 1.6).k1 = -0.5f;
    add("SIMPLE_DIVISION", kind::division, 0.6, 0.6).k1 = 0.05f;
    auto& full = add("FULL_OPENCV", kind::perspective, 0.6, 0.7);
    full.k1 = 0.15f, full.k2 = -0.02f, full.p1 = 0.002f, full.p2 = -0.001f, full.k3 = 0.01f, full.d1 = 0.3f,
    full.d2 = 0.02f, full.d3 = -0.004f;
    auto& radial_tangential = add("OPENCV", kind::perspective, 0.6, 0.7);
    radial_tangential.k1 = 0.1f, radial_tangential.k2 = -0.02f, radial_tangential.p1 = 0.002f,
    radial_tangential.p2 = -0.001f;
    add("RADIAL", kind::perspective, 0.6, 0.7).k1 = -0.06f;
    add("EQUIRECTANGULAR", kind::equirectangular, 1, 3.2);
    return out;
  }();
  return all;
}

inline gart::camera camera_of(named_lens const& l, int side) {
  gart::camera c;
  c.kind = l.kind, c.lens = l.lens;
  c.width = l.kind == gart::camera_kind::equirectangular ? 2 * side : side, c.height = side;
  c.fx = static_cast<float>(l.focal * side), c.fy = static_cast<float>(1.01 * l.focal * side);
  c.cx = static_cast<float>(0.51 * side), c.cy = static_cast<float>(0.49 * side);
  return c;
}

// Where a direction in the camera's axes lies on the image.
inline void image_by_definition(gart::camera const& c, double x, double y, double z, double& u, double& v) {
  constexpr double pi = 3.14159265358979323846;
  if (c.kind == gart::camera_kind::equirectangular) {
    u = c.width * (std::atan2(x, z) / (2 * pi) + 0.5);
    v = c.height * (std::atan2(y, std::sqrt(x * x + z * z)) / pi + 0.5);
    return;
  }
  gart::distortion const& l = c.lens;
  double const across = std::sqrt(x * x + y * y);
  double q = 0;
  switch (c.kind) {
    case gart::camera_kind::perspective:
      q = across / z;
      break;
    case gart::camera_kind::fov:
      q = std::atan(2 * std::tan(0.5 * l.omega) * across / z) / l.omega;
      if (z < 0) q += pi / l.omega;
      break;
    case gart::camera_kind::eucm:
      q = across / (l.alpha * std::sqrt(l.beta * across * across + z * z) + (1 - l.alpha) * z);
      break;
    case gart::camera_kind::division: {
      // The undistorted radius is q / (1 + k q^2): of the two roots the one that is 0 on the axis.
      double const t = across / z;
      q = (1 - std::copysign(std::sqrt(1 - 4 * l.k1 * t * t), z)) / (2 * l.k1 * t);
      break;
    }
    default:
      q = std::atan2(across, z);
  }
  double const a = across > 0 ? q * x / across : 0, b = across > 0 ? q * y / across : 0, r2 = q * q;
  double factor = 1;
  bool const curved =
      c.kind == gart::camera_kind::fov || c.kind == gart::camera_kind::eucm || c.kind == gart::camera_kind::division;
  if (!curved) {
    double const k[] = {l.k1, l.k2, l.k3, l.k4, l.k5, l.k6}, d[] = {l.d1, l.d2, l.d3};
    double top = 1, under = 1, power = r2;
    for (int i = 0; i < 6; ++i, power *= r2) top += k[i] * power, under += i < 3 ? d[i] * power : 0;
    factor = top / under;
  }
  bool const after = c.kind == gart::camera_kind::fisheye624;
  double const bx = after ? a * factor : a, by = after ? b * factor : b, b2 = bx * bx + by * by;
  double const p1 = l.p1, p2 = l.p2;
  u = a * factor + 2 * p1 * bx * by + p2 * (b2 + 2 * bx * bx) + l.s1 * b2 + l.s2 * b2 * b2;
  v = b * factor + 2 * p2 * bx * by + p1 * (b2 + 2 * by * by) + l.s3 * b2 + l.s4 * b2 * b2;
  u = c.fx * u + c.cx, v = c.fy * v + c.cy;
}

// The largest angle with the axis that the camera gives a ray to; what lies beyond it the definition may fold back.
inline double last_angle(gart::camera const& c) {
  if (c.kind == gart::camera_kind::equirectangular) return 4;
  gart::radial_lens const model(c);
  return gart::lens_bounds(model.curve, c.fx, c.fy, c.cx, c.cy, c.width, c.height).last();
}

// Which directions lie beyond that angle, by its cosine: arc tangents of all points would take longer than their
// images.
class beyond_angle {
 public:
  explicit beyond_angle(double angle) : cosine(angle < std::acos(-1.0) ? std::cos(angle) : -2) {}
  bool operator()(gart::vec3d const& p) const { return p.z < cosine * std::sqrt(glm::dot(p, p)); }

 private:
  double cosine;
};

}  // namespace gart_test
