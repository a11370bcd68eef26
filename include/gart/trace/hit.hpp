#pragma once
/// \file
/// A hit of a ray: where it is, which Gaussian, and how opaque.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

namespace gart { inline namespace GART_ISA {

/// The data of a hit for a ray program.
struct hit {
  float t = 0;      ///< distance along the unit ray of the point of largest response
  u32 id = 0;       ///< the Gaussian
  float alpha = 0;  ///< min(0.99, sigma * rho)
};

/// The order of hits on a ray: by distance, ties by id. Total, so that a traversal resumed "strictly after" loses
/// nothing.
GART_HD constexpr bool before(float t_a, u32 id_a, float t_b, u32 id_b) {
  return t_a < t_b || (t_a == t_b && id_a < id_b);
}

}}  // namespace gart::GART_ISA
