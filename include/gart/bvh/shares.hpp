#pragma once
/// \file
/// Chooses the nodes of a binary tree that become wide ones, so that rays cross the fewest wide nodes. A node's chance
/// to be crossed is the area of its box (Ylitie, Karras and Laine 2017, section 3). From the leaves up, a node finds
/// the cost of handing 1, 2, ... children to the wide node above. It hands on itself as a wide node, or what its two
/// sides hand on, each its share. From the root down the shares are dealt out.

#include <gart/bvh/node.hpp>

namespace gart { inline namespace GART_ISA { namespace bvh_kernels {

// of[k]: the least area of wide nodes in a subtree that hands k or fewer children on. A leaf costs nothing: every leaf
// is the child of one wide node, whichever it is.
struct alignas(16) wide_costs {
  float of[bvh_width];  // of[0] is not used
};

GART_HD GART_INLINE float half_area(box const& b) {
  if (!(b.lo.x <= b.hi.x)) return 0;
  vec3 const size = b.hi - b.lo;
  return size.x * size.y + size.y * size.z + size.z * size.x;
}

// A node's use of its share of a wide node's children.
struct wide_shares {
  static_assert(bvh_width <= 8);
  u32 bits = 0;  // 3 a number k of children from 2 up: how many the first side hands on; then one: k beats k - 1

  // Of k children at most, how many it hands on; 1: itself, as a wide node.
  GART_HD GART_INLINE int used(int k) const {
    while (k > 1 && !(bits >> (19 + k) & 1u)) --k;
    return k;
  }
  // Of k, as many as a wide node has or as used() says, how many come from the first side.
  GART_HD GART_INLINE int first(int k) const { return static_cast<int>(bits >> 3 * (k - 2) & 7u); }
};

// The costs of a node of this area over those of its two sides.
GART_HD GART_INLINE wide_costs costs_of(float area, wide_costs const& a, wide_costs const& b, wide_shares& shares) {
  float split[bvh_width + 1];
  GART_UNROLL
  for (int k = 2; k <= bvh_width; ++k) {
    float least = a.of[1] + b.of[k - 1];
    u32 first = 1;
    GART_UNROLL
    for (int j = 2; j < k; ++j) {
      float const cost = a.of[j] + b.of[k - j];
      if (cost < least) least = cost, first = static_cast<u32>(j);
    }
    split[k] = least;
    shares.bits |= first << 3 * (k - 2);
  }
  wide_costs out;
  out.of[0] = 0;
  out.of[1] = area + split[bvh_width];
  GART_UNROLL
  for (int k = 2; k < bvh_width; ++k) {
    // As good will do: it saves a node.
    bool const better = split[k] <= out.of[k - 1];
    out.of[k] = better ? split[k] : out.of[k - 1];
    shares.bits |= (better ? 1u : 0u) << (19 + k);
  }
  return out;
}

}}}  // namespace gart::GART_ISA::bvh_kernels
