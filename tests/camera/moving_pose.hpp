#pragma once
// Cameras that move while they are exposed, in double.

#include "lenses.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>

namespace gart_test {

using gart::shutter_kind;

inline constexpr shutter_kind shutters[] = {shutter_kind::top_to_bottom, shutter_kind::left_to_right,
                                            shutter_kind::bottom_to_top, shutter_kind::right_to_left};

// Poses of lines by their definition: quaternions along the great circle, positions along the line.
struct moving_pose {
  double q[2][4];
  gart::vec3d p[2];

  moving_pose(std::mt19937_64& random, double angle, double distance) {
    std::normal_distribution<double> normal;
    double turn[4] = {std::cos(angle / 2), 0, 0, 0}, length = 0, turn_length = 0;
    for (double& v : q[0]) v = normal(random), length += v * v;
    for (double& v : q[0]) v /= std::sqrt(length);
    for (int k = 1; k < 4; ++k) turn[k] = normal(random), turn_length += turn[k] * turn[k];
    for (int k = 1; k < 4; ++k) turn[k] *= std::sin(angle / 2) / std::sqrt(turn_length);
    auto const& a = q[0];
    q[1][0] = a[0] * turn[0] - a[1] * turn[1] - a[2] * turn[2] - a[3] * turn[3];
    q[1][1] = a[0] * turn[1] + a[1] * turn[0] + a[2] * turn[3] - a[3] * turn[2];
    q[1][2] = a[0] * turn[2] - a[1] * turn[3] + a[2] * turn[0] + a[3] * turn[1];
    q[1][3] = a[0] * turn[3] + a[1] * turn[2] - a[2] * turn[1] + a[3] * turn[0];
    gart::vec3d step;
    for (int k = 0; k < 3; ++k) p[0][k] = normal(random), step[k] = normal(random);
    p[1] = p[0] + glm::normalize(step) * distance;
  }
  // t from 0, the first line that is read, to 1, the last.
  gart::vec3d position(double t) const { return p[0] * (1 - t) + p[1] * t; }
  gart::mat3d axes(double t) const {
    double cosine = 0, at[4];
    for (int k = 0; k < 4; ++k) cosine += q[0][k] * q[1][k];
    double const angle = std::acos(std::min(cosine, 1.0)), sine = std::sin(angle);
    for (int k = 0; k < 4; ++k)
      at[k] = sine > 1e-9 ? (std::sin((1 - t) * angle) * q[0][k] + std::sin(t * angle) * q[1][k]) / sine : q[0][k];
    double const w = at[0], x = at[1], y = at[2], z = at[3];
    gart::mat3d out;
    out[0] = {1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)};
    out[1] = {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)};
    out[2] = {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)};
    return out;
  }
  gart::camera at(gart::camera c, double t) const {
    c.position = position(t), c.rotation = gart::mat3(axes(t));
    return c;
  }
  gart::camera rolling(gart::camera const& c, shutter_kind shutter) const {
    return gart::rolling_between(at(c, 0), at(c, 1), shutter);
  }
};

inline bool columns_of(shutter_kind s) { return s == shutter_kind::left_to_right || s == shutter_kind::right_to_left; }
inline bool from_end(shutter_kind s) { return s == shutter_kind::bottom_to_top || s == shutter_kind::right_to_left; }

inline gart::camera lens_named(char const* name, int side) {
  for (auto const& lens : lenses())
    if (std::string(lens.name) == name) return camera_of(lens, side);
  FAIL("no such lens");
  return {};
}

}  // namespace gart_test
