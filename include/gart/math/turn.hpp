#pragma once
/// \file
/// Turns as a vector, the axis times the angle in radians, and as a matrix: the exponential map of rotations, there and
/// back. In double.

#include <gart/core/isa.hpp>
#include <gart/core/macros.hpp>
#include <gart/math/glm.hpp>

#include <cmath>

namespace gart::inline GART_ISA {

/// exp([w]x), the turn by |w| about w.
GART_HD inline mat3d turn_of(vec3d const& w) {
  double const angle2 = w.x * w.x + w.y * w.y + w.z * w.z, angle = sqrt(angle2);
  double const a = angle > 1e-6 ? sin(angle) / angle : 1 - angle2 / 6;
  double const b = angle > 1e-3 ? (1 - cos(angle)) / angle2 : 0.5 - angle2 / 24;
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

}  // namespace gart::inline GART_ISA
