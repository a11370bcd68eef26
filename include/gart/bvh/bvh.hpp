#pragma once
// A binary bounding volume hierarchy over boxes, built on the policy's own sort (Karras, "Maximizing parallelism in the
// construction of BVHs, octrees, and k-d trees", HPG 2012): Morton codes of the box centres, a radix sort, one thread
// an inner node, boxes fitted from the leaves up. refit keeps the tree and fits its boxes to new ones.
//
// Shapes: n boxes make max(n - 1, 1) nodes of 64 bytes; node 0 is the root. Cost: O(n) work beside the sort.
// Boxes that are empty (empty_box) are never met.

#include <gart/bvh/box.hpp>
#include <gart/core/span.hpp>
#include <gart/exec/buffer.hpp>

namespace gart {

// Both children's boxes lie in their parent, so that one 64-byte load decides both ways.
struct alignas(16) bvh_node {
  static constexpr u32 leaf = 0x80000000u;
  float lo[2][3], hi[2][3];
  u32 child[2];  // a node, or leaf | index of the box
  u32 parent;    // of this node; the root's is itself
  u32 unused;

  GART_HD box child_box(int c) const {
    return {vec3(lo[c][0], lo[c][1], lo[c][2]), vec3(hi[c][0], hi[c][1], hi[c][2])};
  }
  GART_HD void set_child_box(int c, box const& b) {
    for (int k = 0; k < 3; ++k) lo[c][k] = b.lo[k], hi[c][k] = b.hi[k];
  }
};

struct bvh_view {
  bvh_node const* nodes = nullptr;
  index_t count = 0;  // boxes
};

template <execution E>
class bvh {
 public:
  bvh() = default;
  explicit bvh(E& exec)
      : nodes_(exec), leaf_parent_(exec), arrivals_(exec), codes_(exec), order_(exec), bounds_(exec) {}

  void build(E& exec, span<box const> boxes);
  // For the same number of boxes as the last build.
  void refit(E& exec, span<box const> boxes);
  bvh_view view() const { return {nodes_.data(), count_}; }

 private:
  buffer<bvh_node, E> nodes_;
  buffer<u32, E> leaf_parent_;  // by sorted position: parent << 1 | side
  buffer<u32, E> arrivals_;
  buffer<u64, E> codes_;
  buffer<u32, E> order_;
  buffer<box, E> bounds_;
  index_t count_ = 0;
};

}  // namespace gart

#include <gart/bvh/bvh_impl.hpp>
