#pragma once
/// \file
/// Directions of light at a smooth surface: reflection, refraction by Snell, and how much of each by Fresnel.
/// Directions and normals are unit vectors. The arithmetic is fixed, as in math/arith.hpp.

#include <gart/core/macros.hpp>
#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>

namespace gart { inline namespace GART_ISA {

/// Of length 1.
GART_HD GART_INLINE vec3 unit(vec3 const& v) { return v * reciprocal(square_root(glm::dot(v, v))); }

/// Fresnel's reflection of a dielectric, unpolarised. `cosine` is that on the light's side, `ratio` that of the indices
/// from there to the other side. 1 where all is reflected.
GART_HD GART_INLINE float fresnel(float cosine, float ratio) {
  float const sine2 = ratio * ratio * fmaxf(0.0f, 1.0f - cosine * cosine);
  if (sine2 >= 1.0f) return 1.0f;
  float const other = square_root(1.0f - sine2);
  float const p = (cosine - ratio * other) / (cosine + ratio * other),
              s = (ratio * cosine - other) / (ratio * cosine + other);
  return 0.5f * (p * p + s * s);
}

/// n against the direction. Snell's law, without total reflection.
GART_HD GART_INLINE vec3 refracted(vec3 const& direction, vec3 const& n, float ratio) {
  float const cosine = -glm::dot(direction, n);
  float const other = square_root(fmaxf(0.0f, 1.0f - ratio * ratio * fmaxf(0.0f, 1.0f - cosine * cosine)));
  return unit(ratio * direction + (ratio * cosine - other) * n);
}
/// A mirror.
GART_HD GART_INLINE vec3 reflected(vec3 const& direction, vec3 const& n) {
  return unit(direction - 2.0f * glm::dot(direction, n) * n);
}

}}  // namespace gart::GART_ISA
