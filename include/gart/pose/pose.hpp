#pragma once
/// \file
/// Small changes of a camera's pose: six numbers, in the camera's own axes,
///   position = position_0 + unit R_0 t,   rotation = R_0 exp([w]x),
/// t in a unit of length, of a training the scene's extent, and w in radians; and the gradient of a function of the
/// image by a pose, in world axes. In double: a step of a training may move a pose by less than a float tells.

#include <gart/core/isa.hpp>
#include <gart/core/types.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/camera.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace gart {

/// dL/d pose, in world axes.
struct pose_gradient {
  static constexpr int floats = 6;  ///< numbers
  vec3d translation{0.0};           ///< by the position, in world units
  vec3d rotation{0.0};  ///< by a small turn w of the camera about its position: a direction d becomes d + w x d

  ///@{
  /// Zero, or from six numbers in this order.
  pose_gradient() = default;
  explicit pose_gradient(float const* v) : translation(v[0], v[1], v[2]), rotation(v[3], v[4], v[5]) {}
  ///@}
};

/// Six numbers of a pose: t, then w.
using pose_numbers = std::array<double, 6>;

/// The poses of all training views as they are learned, and Adam's moments of them, as a checkpoint holds them.
struct pose_state {
  std::vector<double> value;          ///< [views][6]: what `moved` is given; empty: no poses are learned
  std::vector<double> first, second;  ///< [views][6]: in the numbers of the metric
  std::vector<double> metric;         ///< [views][6][6] (pose/pose_metric.hpp), zeros before the first visit
  std::vector<u32> visits;            ///< [views] steps that moved the view
};

}  // namespace gart

namespace gart::inline GART_ISA {

/// exp([w]x), the turn by |w| about w.
inline mat3d turn_of(vec3d const& w) {
  double const angle2 = w.x * w.x + w.y * w.y + w.z * w.z, angle = std::sqrt(angle2);
  double const a = angle > 1e-6 ? std::sin(angle) / angle : 1 - angle2 / 6;
  double const b = angle > 1e-3 ? (1 - std::cos(angle)) / angle2 : 0.5 - angle2 / 24;
  mat3d out(1.0);
  double const v[3] = {w.x, w.y, w.z};
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) out[j][i] = (i == j ? 1 - b * angle2 : 0) + b * v[i] * v[j];
  out[0][1] += a * w.z, out[1][0] -= a * w.z;
  out[0][2] -= a * w.y, out[2][0] += a * w.y;
  out[1][2] += a * w.x, out[2][1] -= a * w.x;
  return out;
}

/// The turn w of turn_of, of at most pi.
inline vec3d angles_of(mat3d const& r) {
  vec3d const side(r[1][2] - r[2][1], r[2][0] - r[0][2], r[0][1] - r[1][0]);
  double const sine = 0.5 * std::sqrt(side.x * side.x + side.y * side.y + side.z * side.z);
  double const cosine = 0.5 * (r[0][0] + r[1][1] + r[2][2] - 1), angle = std::atan2(sine, cosine);
  if (sine > 1e-9) return side * (0.5 * angle / sine);
  if (cosine > 0) return side * 0.5;
  // Half a turn: r + 1 = 2 axis axis^T.
  int k = 0;
  for (int j = 1; j < 3; ++j) k = r[j][j] > r[k][k] ? j : k;
  vec3d const column(r[k][0] + (k == 0), r[k][1] + (k == 1), r[k][2] + (k == 2));
  return column * (angle / std::sqrt(column.x * column.x + column.y * column.y + column.z * column.z));
}

/// The camera's axes, orthonormal in double: floats are off by their roundings.
inline mat3d axes_of(camera const& view) {
  vec3d x(view.rotation[0]), y(view.rotation[1]);
  x = glm::normalize(x);
  y = glm::normalize(y - x * glm::dot(x, y));
  mat3d out(1.0);
  out[0] = x, out[1] = y, out[2] = glm::cross(x, y);
  return out;
}

/// The camera with the pose changed: all else stays.
inline camera moved(camera view, pose_numbers const& by, double unit) {
  mat3d const axes = axes_of(view), turned = axes * turn_of({by[3], by[4], by[5]});
  view.position += axes * vec3d(by[0], by[1], by[2]) * unit;
  for (int k = 0; k < 3; ++k) view.rotation[k] = vec3(turned[k]);
  return view;
}

/// What `moved` must be given to come from one camera's pose to another's.
inline pose_numbers pose_between(camera const& from, camera const& to, double unit) {
  mat3d const back = glm::transpose(axes_of(from));
  vec3d const t = back * (to.position - from.position) / unit, w = angles_of(back * axes_of(to));
  return {t.x, t.y, t.z, w.x, w.y, w.z};
}

/// The gradient by the numbers that `moved` is given, from that by the pose where they lead: turns do not commute, so
/// that dL/dw is J^T of what the camera's axes see of it, J the left Jacobian of the exponential map.
inline pose_numbers pull_back(camera const& from, pose_numbers const& at, double unit, pose_gradient const& by) {
  mat3d const back = glm::transpose(axes_of(from));
  vec3d const t = back * by.translation * unit, g = back * by.rotation, w(at[3], at[4], at[5]);
  double const angle2 = glm::dot(w, w), angle = std::sqrt(angle2);
  double const a = angle > 1e-3 ? (1 - std::cos(angle)) / angle2 : 0.5 - angle2 / 24;
  double const b = angle > 1e-3 ? (angle - std::sin(angle)) / (angle2 * angle) : 1.0 / 6 - angle2 / 120;
  // J = 1 + a [w]x + b [w]x^2; its transpose turns the other way.
  vec3d const once = glm::cross(w, g), r = g - once * a + glm::cross(w, once) * b;
  return {t.x, t.y, t.z, r.x, r.y, r.z};
}

}  // namespace gart::inline GART_ISA
