#pragma once
/// \file
/// The motion of a camera while its shutter goes over the image (scene/camera.hpp). It comes from the poses of the
/// first and the last line that are read, and gives them back. Files have these poses. A camera holds its pose at the
/// middle of the read-out. It also holds its motion, in its own axes, while the shutter goes from border to border:
///   rotation(s) = R exp(s [turn]x),   position(s) = p + s R travel,   -1/2 <= s <= 1/2:
/// linear in translation, slerp in rotation. So a camera that is moved as a whole takes its motion along. An image of
/// another size has the same motion.

#include <gart/math/turn.hpp>
#include <gart/scene/camera.hpp>

namespace gart { inline namespace GART_ISA {

/// The camera's axes, orthonormal in double: floats are off by their roundings.
inline mat3d axes_of(camera const& view) {
  vec3d x(view.rotation[0]), y(view.rotation[1]);
  x = glm::normalize(x);
  y = glm::normalize(y - x * glm::dot(x, y));
  mat3d out(1.0);
  out[0] = x, out[1] = y, out[2] = glm::cross(x, y);
  return out;
}

/// The lines that a shutter exposes, and when.
struct shutter_lines_of {
  int count = 1;          ///< lines
  bool columns = false;   ///< rather than rows
  bool from_end = false;  ///< the last line first

  shutter_lines_of() = default;
  /// Of a camera.
  GART_HD explicit shutter_lines_of(camera const& c)
      : columns(c.shutter == shutter_kind::left_to_right || c.shutter == shutter_kind::right_to_left),
        from_end(c.shutter == shutter_kind::bottom_to_top || c.shutter == shutter_kind::right_to_left) {
    count = columns ? c.width : c.height;
  }
  /// The time of a place on the image, in double or as fixed, -1/2 to 1/2.
  template <class N>
  GART_HD N time_at(N u, N v) const {
    N const s = (columns ? u : v) / N(static_cast<double>(count)) - N(0.5);
    return from_end ? -s : s;
  }
};

/// How many lines the shutter passes one after another.
inline int shutter_lines(camera const& view) { return shutter_lines_of(view).count; }

/// The camera at a time of the read-out, -1/2 to 1/2, without a motion.
inline camera at_time(camera view, double s) {
  mat3d const axes = axes_of(view), turned = axes * turn_of(vec3d(view.turn) * s);
  view.position += axes * vec3d(view.travel) * s;
  if (view.turn != vec3(0.0f))
    for (int k = 0; k < 3; ++k) view.rotation[k] = vec3(turned[k]);
  view.shutter = shutter_kind::global, view.travel = view.turn = vec3(0.0f);
  return view;
}

/// The camera while the first line that is read is exposed, and the last.
struct line_poses {
  camera first, last;  ///< without a motion
};

/// Of a camera.
inline line_poses poses_of_lines(camera const& view) {
  double const half = 0.5 - 0.5 / shutter_lines(view);
  return {at_time(view, -half), at_time(view, half)};
}

/// A camera with a rolling shutter. `first` has the pose of the first line that is read, `last` that of the last. The
/// image must have a size, and two lines or more.
inline camera rolling_between(camera first, camera const& last, shutter_kind shutter) {
  first.shutter = shutter;
  int const lines = shutter_lines(first);
  double const share = lines / (lines - 1.0), middle = 0.5;
  mat3d const from = axes_of(first);
  vec3d const turn = angles_of(glm::transpose(from) * axes_of(last)), travel = last.position - first.position;
  mat3d const axes = from * turn_of(turn * middle);
  first.position += travel * middle;
  for (int k = 0; k < 3; ++k) first.rotation[k] = vec3(axes[k]);
  first.travel = vec3(glm::transpose(axes) * travel * share), first.turn = vec3(turn * share);
  return first;
}

/// The camera with a part of its image, from its top left corner: its shutter goes over that alone.
inline camera cropped(camera c, int width, int height) {
  if (c.shutter != shutter_kind::global) {
    shutter_lines_of const before(c);
    double const share = static_cast<double>(before.columns ? width : height) / before.count;
    double const middle = (before.from_end ? 0.5 : -0.5) * (1 - share);
    camera const at = at_time(c, middle);
    c.travel = vec3(turn_of(vec3d(c.turn) * -middle) * vec3d(c.travel) * share), c.turn *= static_cast<float>(share);
    c.position = at.position, c.rotation = at.rotation;
  }
  c.width = width, c.height = height;
  return c;
}

}}  // namespace gart::GART_ISA
