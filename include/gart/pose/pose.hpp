#pragma once
/// \file
/// Small changes of a camera's pose: six numbers, in the camera's own axes,
///   position = position_0 + unit R_0 t,   rotation = R_0 exp([w]x),
/// t in units of length (in training the scene's extent), w in radians. Also the gradient of a function of the image by
/// a pose, in world axes. All in double: a training step may move a pose by less than a float resolves.

#include <gart/camera/shutter.hpp>
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

}  // namespace gart

namespace gart { inline namespace GART_ISA {

/// The camera with a changed pose; all else stays.
inline camera moved(camera view, pose_numbers const& by, double unit) {
  mat3d const axes = axes_of(view), turned = axes * turn_of({by[3], by[4], by[5]});
  view.position += axes * vec3d(by[0], by[1], by[2]) * unit;
  for (int k = 0; k < 3; ++k) view.rotation[k] = vec3(turned[k]);
  return view;
}

/// The gradient by the argument of `moved`, from that by the resulting pose. Turns do not commute. So dL/dw is J^T
/// times the gradient in the camera's axes, J the left Jacobian of the exponential map.
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

}}  // namespace gart::GART_ISA
