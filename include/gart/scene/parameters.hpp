#pragma once
/// \file
/// One Gaussian out of the arrays.

#include <gart/math/ray_gaussian.hpp>
#include <gart/scene/gaussians.hpp>

namespace gart { inline namespace GART_ISA {

/// Gaussian i.
GART_HD GART_INLINE gaussian_parameters load_parameters(gaussians_view<float const> const& g, index_t i) {
  float const* m = g.mean + std::size_t{3} * i;
  float const* s = g.log_scale + std::size_t{3} * i;
  float const* q = g.quaternion + std::size_t{4} * i;
  return {vec3(m[0], m[1], m[2]), vec3(s[0], s[1], s[2]), {q[0], q[1], q[2], q[3]}, g.opacity[i]};
}

}}  // namespace gart::GART_ISA
