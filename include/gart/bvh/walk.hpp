#pragma once
/// \file
/// Visits the leaves of a BVH that a ray may meet between two distances, nearer nodes first. The visitor chooses the
/// children to enter, and may narrow its choice as it goes:
///   float near(), far();    only boxes the ray crosses somewhere in [near, far] are entered; 0 or more
///   void leaf(u32 box);     every box that the ray crosses there, once, and some that it just misses
/// Any ray type with a unit `direction` and an origin_of(ray). Callers that want the boxes themselves test the
/// proposals with crosses(box, ...).

#include <gart/bvh/bvh.hpp>
#include <gart/bvh/cross.hpp>

namespace gart { inline namespace GART_ISA {

/// The place of the lowest bit that is set; of a word that is not zero.
GART_HD GART_INLINE int lowest_bit(u32 bits) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(bits)) - 1;
#else
  return __builtin_ctz(bits);
#endif
}

/// A distance to sort by: its last 3 bits make room for a child's number.
GART_HD GART_INLINE u32 distance_key(float entry) { return float_to_bits(larger(entry, 0.0f)) & ~7u; }

/// The children in `wanted` by distance, nearest in the lowest bits: 4 bits each, 8 + c, so that 0 is none left.
GART_HD GART_INLINE u32 near_to_far(u32 wanted, float const (&entry)[bvh_width]) {
  u32 order = 0;
  if (wanted == 0) return order;
#if defined(__CUDA_ARCH__)
  u32 keys[bvh_width];
  GART_UNROLL
  for (int c = 0; c < bvh_width; ++c)
    keys[c] = wanted >> c & 1u ? distance_key(entry[c]) | static_cast<u32>(c) : 0xffffffffu;
  auto const exchange = [&](int a, int b) {
    u32 const less = keys[a] < keys[b] ? keys[a] : keys[b], more = keys[a] < keys[b] ? keys[b] : keys[a];
    keys[a] = less, keys[b] = more;
  };
  // Batcher's odd-even merge sort.
  GART_UNROLL
  for (int p = 1; p < bvh_width; p *= 2) {
    GART_UNROLL
    for (int k = p; k >= 1; k /= 2) {
      GART_UNROLL
      for (int i = k % p; i + k < bvh_width; ++i)
        if ((i - k % p) / k % 2 == 0 && i / (2 * p) == (i + k) / (2 * p)) exchange(i, i + k);
    }
  }
  GART_UNROLL
  for (int c = bvh_width - 1; c >= 0; --c) order = order << 4 | (keys[c] == 0xffffffffu ? 0u : 8u | (keys[c] & 7u));
#else
  u32 keys[bvh_width];
  int count = 0;
  for (; wanted != 0; wanted &= wanted - 1) {
    int const c = lowest_bit(wanted);
    u32 const key = distance_key(entry[c]) | static_cast<u32>(c);
    int at = count++;
    for (; at > 0 && keys[at - 1] > key; --at) keys[at] = keys[at - 1];
    keys[at] = key;
  }
  for (int k = count - 1; k >= 0; --k) order = order << 4 | 8u | (keys[k] & 7u);
#endif
  return order;
}

/// Walks the tree along a ray; the visitor takes its leaves.
template <class Ray, class Visitor>
GART_HD GART_INLINE void walk(bvh_view const& tree, Ray const& r, Visitor& visitor) {
  if (tree.count == 0) return;
  // 63 bits of code and at most 32 of position bound the depth. A level leaves at most one node with children to enter.
  constexpr int depth = 96;
  struct {
    u32 node, order;
  } pending[depth];
  int top = 0;
  slab_ray const slab(r);
  u32 node = 0;
  for (;;) {
    bvh_node const& n = tree.nodes[node];
    float entry[bvh_width];
    auto const& bounds = load_bounds(n);
    u32 const crossed = cross_children(bounds, slab, visitor.near(), visitor.far(), entry);
    for (u32 leaves = crossed & bounds.leaf_mask(); leaves != 0; leaves &= leaves - 1)
      visitor.leaf(n.child[lowest_bit(leaves)]);
    u32 order = near_to_far(crossed & bounds.inner_mask(), entry);
    while (order == 0) {
      if (top == 0) return;
      --top;
      node = pending[top].node;
      // Where the nearest of a node's children is too far by now, so are the rest.
      float const next = enter_child(tree.nodes[node], static_cast<int>(pending[top].order & 7u), slab, visitor.near());
      if (bits_to_float(distance_key(next)) <= visitor.far()) order = pending[top].order;
    }
    u32 const rest = order >> 4;
    if (rest != 0) pending[top++] = {node, rest};
    node = tree.nodes[node].child[order & 7u];
  }
}

}}  // namespace gart::GART_ISA
