#pragma once
/// \file
/// Splits a Gaussian in two along its longest axis (Deng et al., Efficient Density Control for 3D Gaussian Splatting,
/// 2024). The children end where it ended and have its thickness at their centres, so the silhouette stays. With q =
/// split_shape::offset and s the longest standard deviation, their centres lie at +-q 3 s. They are 1 - q times as
/// long, since q 3 s + (1 - q) 3 s = 3 s. They are sqrt(1 - q^2) times as thick, the cross-section there at three
/// standard deviations. Between middle and end they reach up to 6% further out where q = 0.4. Their opacity is
/// split_shape::opacity times the parent's. It rises again where a child is needed, and fades where not, which reduces
/// overfitting.

#include <gart/math/quaternion.hpp>
#include <gart/optim/options.hpp>

namespace gart { inline namespace GART_ISA {

/// The two children.
struct split_child {
  vec3 offset;     ///< from the old centre to one child's; the other has its negative
  vec3 log_scale;  ///< of both
  float opacity;   ///< of each
};

/// The children of a Gaussian of this opacity, in (0, 1).
GART_HD inline split_child split_long_axis(split_shape const& shape, vec3 const& log_scale, quaternion const& rotation,
                                           float opacity) {
  int const axis = log_scale.x >= log_scale.y   ? (log_scale.x >= log_scale.z ? 0 : 2)
                   : log_scale.y >= log_scale.z ? 1
                                                : 2;
  float const thickness = sqrtf(1.0f - shape.offset * shape.offset);
  split_child out{vec3(0.0f), log_scale, shape.opacity * opacity};
  for (int k = 0; k < 3; ++k) out.log_scale[k] += logf(k == axis ? 1.0f - shape.offset : thickness);
  if (norm2(rotation) > quaternion_norm2_min)
    out.offset = to_matrix(rotation)[axis] * (3.0f * shape.offset * expf(log_scale[axis]));
  return out;
}

}}  // namespace gart::GART_ISA
