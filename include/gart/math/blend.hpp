#pragma once
/// \file
/// Front-to-back compositing of one hit: C += T alpha c,  D += T alpha t,  T *= 1 - alpha.

#include <gart/core/macros.hpp>
#include <gart/math/glm.hpp>

namespace gart { inline namespace GART_ISA {

/// Adds a hit of colour c to a ray, or to one a lane; returns its weight T alpha.
template <class F>
GART_HD GART_INLINE F blend(F alpha, F t, vec3_of<F> const& c, vec3_of<F>& color, F& depth, F& transmittance) {
  F const weight = transmittance * alpha;
  color.x += weight * c.x, color.y += weight * c.y, color.z += weight * c.z;
  depth += weight * t;
  transmittance *= F(1.0f) - alpha;
  return weight;
}

/// The colour that a ray with these values would have if a hit of colour c were opaque. The hit's alpha decides the
/// pixel's difference from it (math/hit_gradient.hpp).
template <class F>
GART_HD GART_INLINE vec3_of<F> opaque_color(vec3_of<F> const& c, vec3_of<F> const& color, F transmittance) {
  return {color.x + transmittance * c.x, color.y + transmittance * c.y, color.z + transmittance * c.z};
}

/// The depth that it would have: the same with t for the colour.
template <class F>
GART_HD GART_INLINE F opaque_depth(F t, F depth, F transmittance) {
  return depth + transmittance * t;
}

}}  // namespace gart::GART_ISA
