#pragma once
/// \file
/// Turns as a vector, the axis times the angle in radians, and as a matrix. The exponential map of rotations leads
/// there and back. In double.

#include <gart/core/isa.hpp>
#include <gart/core/macros.hpp>
#include <gart/math/glm.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// v turned about a unit axis by the angle of this sine and cosine: Rodrigues' formula. F: double, or where bits count
/// fixed_double.
template <class F>
GART_HD vec3_of<F> turned_about(vec3_of<F> const& axis, F sine, F cosine, vec3_of<F> const& v) {
  F const along = (axis.x * v.x + axis.y * v.y + axis.z * v.z) * (F(1) - cosine);
  return {v.x * cosine + (axis.y * v.z - axis.z * v.y) * sine + axis.x * along,
          v.y * cosine + (axis.z * v.x - axis.x * v.z) * sine + axis.y * along,
          v.z * cosine + (axis.x * v.y - axis.y * v.x) * sine + axis.z * along};
}

/// exp([w]x), the turn by |w| about w.
GART_HD inline mat3d turn_of(vec3d const& w) {
  mat3d out(1.0);
  double const angle = glm::length(w);
  if (!(angle > 0)) return out;
  vec3d const axis = w / angle;
  double const sine = sin(angle), cosine = cos(angle);
  for (int k = 0; k < 3; ++k) out[k] = turned_about<double>(axis, sine, cosine, out[k]);
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

}}  // namespace gart::GART_ISA
