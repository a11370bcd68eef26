#pragma once
/// \file
/// Rotations as quaternions w, x, y, z of any norm.

#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>

namespace gart { inline namespace GART_ISA {

/// A rotation; of any norm.
struct quaternion {
  float w = 1, x = 0, y = 0, z = 0;  ///< real part first
};

/// |q|^2.
GART_HD GART_INLINE float norm2(quaternion const& q) {
  return fma(q.w, q.w, fma(q.x, q.x, fma(q.y, q.y, mul(q.z, q.z))));
}

/// Below this square of the norm a quaternion has no direction in float: its Gaussian is culled. Readers give shorter
/// ones the length 1 (io/splat_file.hpp), and Adam lengthens them.
inline constexpr float quaternion_norm2_min = 1e-8f;

/// The rotation of the quaternion divided by its norm; columns are the images of the axes.
GART_HD GART_INLINE mat3 to_matrix(quaternion const& q) {
  float const s = divide(2.0f, norm2(q));
  float const xx = mul(mul(q.x, q.x), s), yy = mul(mul(q.y, q.y), s), zz = mul(mul(q.z, q.z), s);
  float const xy = mul(mul(q.x, q.y), s), xz = mul(mul(q.x, q.z), s), yz = mul(mul(q.y, q.z), s);
  float const wx = mul(mul(q.w, q.x), s), wy = mul(mul(q.w, q.y), s), wz = mul(mul(q.w, q.z), s);
  mat3 r;
  r[0] = vec3(add(1.0f, -add(yy, zz)), add(xy, wz), add(xz, -wy));
  r[1] = vec3(add(xy, -wz), add(1.0f, -add(xx, zz)), add(yz, wx));
  r[2] = vec3(add(xz, wy), add(yz, -wx), add(1.0f, -add(xx, yy)));
  return r;
}

/// The gradient by the raw quaternion, 2 q (0, body) / |q| with q normalised. `body` is the gradient by a small
/// rotation w in the body's frame (R exp([w]x)). It has no part along q.
GART_HD GART_INLINE quaternion pull_back(quaternion const& q, vec3 body) {
  float const s = 2.0f / norm2(q);  // one 1/|q| to normalise q, one through the normalisation
  return {s * (-q.x * body.x - q.y * body.y - q.z * body.z), s * (q.w * body.x + q.y * body.z - q.z * body.y),
          s * (q.w * body.y + q.z * body.x - q.x * body.z), s * (q.w * body.z + q.x * body.y - q.y * body.x)};
}

}}  // namespace gart::GART_ISA
