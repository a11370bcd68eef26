#pragma once
/// \file
/// A scene turned, scaled and moved: p -> scale R p + translation, of means, scales, rotations and of the colours that
/// depend on direction. Its image from a camera moved alike is the same one. Other maps (a reflection, another scale
/// an axis) make no Gaussians of Gaussians' parameters, or no colours, and are refused.
///
/// Errors: invalid_argument for a matrix that is none of these.

#include <gart/core/error.hpp>
#include <gart/math/glm.hpp>
#include <gart/math/sh_rotation.hpp>
#include <gart/scene/gaussians.hpp>

#include <array>
#include <cmath>

namespace gart { inline namespace GART_ISA {

/// p -> scale rotation p + translation.
struct similarity {
  mat3d rotation{1.0};     ///< orthonormal, no reflection
  double scale = 1;        ///< more than 0
  vec3d translation{0.0};  ///< world units

  /// Of a point.
  vec3d operator()(vec3d const& p) const { return scale * (rotation * p) + translation; }
};

/// First b, then a.
inline similarity operator*(similarity const& a, similarity const& b) {
  return {a.rotation * b.rotation, a.scale * b.scale, a(b.translation)};
}

/// The rotation by a quaternion w, x, y, z of any norm but 0.
inline mat3d rotation_of(std::array<double, 4> const& q) {
  auto const [w, x, y, z] = q;
  double const s = 2 / (w * w + x * x + y * y + z * z);
  mat3d r;
  r[0] = vec3d(1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y));
  r[1] = vec3d(s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x));
  r[2] = vec3d(s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y));
  return r;
}

/// A unit quaternion w, x, y, z of a rotation: its largest component from the diagonal, the others by that.
inline std::array<double, 4> quaternion_of(mat3d const& r) {
  double const squares[4] = {1 + r[0][0] + r[1][1] + r[2][2], 1 + r[0][0] - r[1][1] - r[2][2],
                             1 - r[0][0] + r[1][1] - r[2][2], 1 - r[0][0] - r[1][1] + r[2][2]};
  int largest = 0;
  for (int k = 1; k < 4; ++k)
    if (squares[k] > squares[largest]) largest = k;
  double const twice = std::sqrt(squares[largest]), s = 0.5 / twice;
  std::array<double, 4> const by_each[4] = {
      {twice / 2, s * (r[1][2] - r[2][1]), s * (r[2][0] - r[0][2]), s * (r[0][1] - r[1][0])},
      {s * (r[1][2] - r[2][1]), twice / 2, s * (r[0][1] + r[1][0]), s * (r[2][0] + r[0][2])},
      {s * (r[2][0] - r[0][2]), s * (r[0][1] + r[1][0]), twice / 2, s * (r[1][2] + r[2][1])},
      {s * (r[0][1] - r[1][0]), s * (r[2][0] + r[0][2]), s * (r[1][2] + r[2][1]), twice / 2}};
  return by_each[largest];
}

/// The similarity of a matrix given row by row, its last row 0 0 0 1.
inline similarity similarity_of(std::array<double, 16> const& m) {
  similarity s;
  mat3d a;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) a[column][row] = m[static_cast<std::size_t>(4 * row + column)];
    s.translation[row] = m[static_cast<std::size_t>(4 * row + 3)];
  }
  auto const dot = [](vec3d const& u, vec3d const& v) { return u.x * v.x + u.y * v.y + u.z * v.z; };
  vec3d const cross(a[0].y * a[1].z - a[0].z * a[1].y, a[0].z * a[1].x - a[0].x * a[1].z,
                    a[0].x * a[1].y - a[0].y * a[1].x);
  double const volume = dot(cross, a[2]);
  s.scale = std::cbrt(volume);
  bool sound = volume > 0 && std::isfinite(volume) && m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1;
  for (int i = 0; sound && i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      sound = sound && std::abs(dot(a[i], a[j]) / (s.scale * s.scale) - (i == j ? 1.0 : 0.0)) < 1e-4;
  if (!sound)
    throw invalid_argument(
        "the matrix is no rotation, scale and translation: its columns must be of one length and "
        "at right angles, without reflection, and its last row 0 0 0 1");
  s.rotation = rotation_of(quaternion_of(a / s.scale));
  return s;
}

/// Turns, scales and moves the Gaussians.
inline void apply(similarity const& s, gaussian_model& model) {
  sh_rotation const turn(s.rotation);
  auto const q = quaternion_of(s.rotation);
  std::size_t const width = 3 * static_cast<std::size_t>(sh_coefficients(model.sh_degree));
  float const log_scale = static_cast<float>(std::log(s.scale));
  for (std::size_t i = 0; i < model.size(); ++i) {
    float* const mean = &model.mean[3 * i];
    vec3d const p = s(vec3d(mean[0], mean[1], mean[2]));
    float* const g = &model.quaternion[4 * i];
    std::array<double, 4> const b{g[0], g[1], g[2], g[3]};
    std::array<double, 4> const turned{
        q[0] * b[0] - q[1] * b[1] - q[2] * b[2] - q[3] * b[3], q[0] * b[1] + q[1] * b[0] + q[2] * b[3] - q[3] * b[2],
        q[0] * b[2] - q[1] * b[3] + q[2] * b[0] + q[3] * b[1], q[0] * b[3] + q[1] * b[2] - q[2] * b[1] + q[3] * b[0]};
    for (int k = 0; k < 3; ++k)
      mean[k] = static_cast<float>(p[k]), model.log_scale[3 * i + static_cast<std::size_t>(k)] += log_scale;
    for (std::size_t k = 0; k < 4; ++k) g[k] = static_cast<float>(turned[k]);
    turn.apply(&model.sh[width * i], model.sh_degree);
  }
}

}}  // namespace gart::GART_ISA
