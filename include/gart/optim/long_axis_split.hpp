#pragma once
/// \file
/// One Gaussian becomes two along its longest axis (Deng et al., Efficient Density Control for 3D Gaussian Splatting,
/// 2024): the children end where it ended and are as thick in their middles as it was there, so the silhouette stays.
/// With q = split_shape::offset and s the longest standard deviation, their centres lie at +-q 3 s, where the
/// cross-section at three standard deviations is sqrt(1 - q^2) of the middle one; they are 1 - q times as long, q 3 s +
/// (1 - q) 3 s = 3 s, and sqrt(1 - q^2) times as thick. Between middle and end they reach up to 6% further out where q
/// = 0.4. Opacity falls to split_shape::opacity of what it was: where a child is needed it rises again, and where not
/// it fades, which keeps a growing model from overfitting its training views.

#include <gart/math/quaternion.hpp>
#include <gart/optim/options.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// What the two children are.
struct split_child {
  vec3 offset;     ///< of one child's centre from the old one; the other's is its negative
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
