#pragma once
/// \file
/// How near a hit lies, the order of tile lists: distance times a factor of the ray's direction,
///   depth = t (direction . axis + offset).
/// The default is the distance itself, an order for rays of any directions. A pinhole takes z, in which its bounds are
/// tighter.

#include <gart/core/macros.hpp>
#include <gart/math/glm.hpp>

namespace gart { inline namespace GART_ISA {

/// What depth is measured along.
struct ray_depth {
  vec3 axis{0.0f};   ///< world axes; zero: the distance itself
  float offset = 1;  ///< of all directions

  /// Depth over distance, of one ray or of one a lane. It is rounded up, so that hits said to lie nearer than a depth
  /// do.
  template <class F>
  GART_HD GART_INLINE F per_distance(vec3_of<F> const& d) const {
    return (d.x * F(axis.x) + d.y * F(axis.y) + d.z * F(axis.z) + F(offset)) * F(1.000002f);
  }
};

}}  // namespace gart::GART_ISA
