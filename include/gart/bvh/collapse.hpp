#pragma once
/// \file
/// From the binary tree to the wide one: which nodes become wide, then their contents. One thread a node for each.

#include <gart/bvh/binary_tree.hpp>

namespace gart { inline namespace GART_ISA { namespace bvh_kernels {

// Up to the root, then down again with the node's share of the children: no thread waits for another.
struct choose_wide {
  span<binary_node const> nodes;
  span<u32> is_wide;
  GART_KERNEL void operator()(index_t i) const {
    u64 path[2] = {0, 0};  // sides, the last in the lowest bit: as deep as a walk's stack and more
    int depth = 0;
    u32 at = i;
    for (; at != 0; ++depth) {
      u32 const up = nodes[at].up;
      path[1] = path[1] << 1 | path[0] >> 63;
      path[0] = path[0] << 1 | (up & 1);
      at = up >> 1;
    }
    int share = 1;
    for (; depth > 0; --depth) {
      binary_node const& n = nodes[at];
      wide_shares const shares{n.shares};
      int const used = shares.used(share), children = used == 1 ? bvh_width : used;
      int const first = shares.first(children), side = static_cast<int>(path[0] & 1);
      share = side == 0 ? first : children - first;
      at = n.child[side];
      path[0] = path[0] >> 1 | path[1] << 63;
      path[1] >>= 1;
    }
    is_wide[i] = wide_shares{nodes[i].shares}.used(share) == 1;
  }
};

struct collapse {
  span<binary_node const> binary;
  span<u32 const> is_wide;
  span<u32 const> place;  // of a wide node among the wide ones
  span<bvh_node> nodes;

  struct children {
    u32 at[bvh_width];  // node << 1 | side: inner ones from the front, leaves from the back
    int inner = 0, leaves = 0;
    box bounds = empty_box();
  };

  GART_KERNEL void operator()(index_t i) const {
    if (!is_wide[i]) return;
    children const found = children_of(i);
    bvh_node out;
    bvh_axis axes[3];
    out.shape = static_cast<u32>(found.inner) << 24 | static_cast<u32>(found.leaves) << 28;
    for (int k = 0; k < 3; ++k) {
      axes[k] = axis_between(found.bounds.lo[k], found.bounds.hi[k]);
      out.origin[k] = axes[k].origin;
      out.shape |= axes[k].exponent << 8 * k;
      for (int w = 0; w < bvh_width / 4; ++w) out.plane[0][k][w] = out.plane[1][k][w] = 0;
    }
    GART_UNROLL
    for (int c = 0; c < bvh_width; ++c) {
      out.child[c] = 0;
      bool const is_inner = c < found.inner;
      if (!is_inner && c < bvh_width - found.leaves) continue;
      binary_node const& n = binary[found.at[c] >> 1];
      int const side = static_cast<int>(found.at[c] & 1);
      out.child[c] = is_inner ? place[n.child[side]] : n.child[side] & ~binary_node::leaf;
      for (int k = 0; k < 3; ++k) {
        out.plane[0][k][c / 4] |= plane_below(axes[k], n.lo[side][k]) << 8 * (c % 4);
        out.plane[1][k][c / 4] |= plane_above(axes[k], n.hi[side][k]) << 8 * (c % 4);
      }
    }
    nodes[place[i]] = out;
  }

 private:
  // Depth first through the nodes between, which are no wide ones.
  GART_KERNEL children children_of(index_t root) const {
    children found;
    u32 between[bvh_width];
    int top = 0;
    between[top++] = root;
    while (top > 0) {
      u32 const index = between[--top];
      binary_node const& n = binary[index];
      for (int side = 1; side >= 0; --side) {
        if (is_empty(n.child_box(side))) continue;
        u32 const child = n.child[side];
        bool const is_leaf = child & binary_node::leaf;
        if (!is_leaf && !is_wide[child]) {
          between[top++] = child;
          continue;
        }
        found.at[is_leaf ? bvh_width - ++found.leaves : found.inner++] = index << 1 | static_cast<u32>(side);
        found.bounds = join(found.bounds, n.child_box(side));
      }
    }
    return found;
  }
};

}}}  // namespace gart::GART_ISA::bvh_kernels
