#pragma once
/// \file
/// Axis-aligned boxes, and the conservative box of a Gaussian's ellipsoid.

#include <gart/math/ray_gaussian.hpp>

namespace gart {

/// Axis-aligned, in the frame's units.
struct box {
  vec3 lo, hi;  ///< the least and the largest corner
};

}  // namespace gart

namespace gart { inline namespace GART_ISA {

inline constexpr float infinity = 3.402823466e38f;  ///< a finite one: no rounding or product makes it a NaN

/// Holds nothing, is the identity of join, and is missed by every ray.
GART_HD constexpr box empty_box() { return {vec3(infinity), vec3(-infinity)}; }

/// The least box that holds both.
GART_HD GART_INLINE box join(box const& a, box const& b) {
  box out;
  for (int k = 0; k < 3; ++k) {
    out.lo[k] = a.lo[k] < b.lo[k] ? a.lo[k] : b.lo[k];
    out.hi[k] = a.hi[k] > b.hi[k] ? a.hi[k] : b.hi[k];
  }
  return out;
}

/// The box, in the frame, of all points where the Gaussian can be hit. Its half-extent is h_k = c sqrt(sum_j (R_kj
/// s_j)^2), c^2 the cutoff. Evaluating a hit in float moves it by a few roundings of the distance to the frame. The box
/// is widened by 32 of them, so no candidate just outside its own box is missed.
template <class Response = generalized_gaussian<>>
GART_HD GART_INLINE box ellipsoid_box(gaussian_parameters const& g, vec3d const& frame, float alpha_min) {
  float const cutoff = hit_cutoff<Response>(g, alpha_min);
  if (cutoff < 0) return empty_box();
  vec3 const center = relative_mean(g.mean, frame);
  mat3 const rotation = to_matrix(g.rotation);
  vec3 const scale = scale_of(g);
  float const c = square_root(cutoff);
  vec3 half;
  for (int k = 0; k < 3; ++k) {
    vec3 const r(rotation[0][k] * scale.x, rotation[1][k] * scale.y, rotation[2][k] * scale.z);
    half[k] = c * square_root(r.x * r.x + r.y * r.y + r.z * r.z);
  }
  float const reach = fabsf(center.x) + fabsf(center.y) + fabsf(center.z) + half.x + half.y + half.z;
  vec3 const pad(4e-6f * reach);
  return {center - half - pad, center + half + pad};
}

}}  // namespace gart::GART_ISA
