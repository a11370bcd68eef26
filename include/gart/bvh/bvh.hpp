#pragma once
/// \file
/// A bounding volume hierarchy over boxes with wide, compressed nodes (bvh/node.hpp), on every policy. A binary tree by
/// Morton codes and the policy's sort (bvh/binary_tree.hpp) is collapsed in one kernel (bvh/collapse.hpp). The same
/// boxes give the same tree on every policy. refit keeps the order of the boxes and fits the tree to where they are
/// now.
///
/// Shapes: n boxes make at most max(n - 1, 1) nodes, about n / 5 of them in use; node 0 is the root. Cost: O(n) work
/// beside the sort, which a refit does without, and about 120 bytes a box of scratch. Nothing waits for the device.
/// Boxes that are empty (empty_box) are never met. Errors: invalid_argument where a refit brings another number of
/// boxes.

#include <gart/bvh/binary_tree.hpp>
#include <gart/exec/buffer.hpp>

namespace gart { inline namespace GART_ISA {

/// The tree as kernels hold it.
struct bvh_view {
  bvh_node const* nodes = nullptr;  ///< [nodes], the root first
  index_t count = 0;                ///< boxes
};

/// The tree and its scratch, in the policy's memory.
template <execution E>
class bvh {
 public:
  ///@{
  /// Over no boxes.
  bvh() = default;
  explicit bvh(E& exec)
      : nodes_(exec),
        binary_(exec),
        leaf_up_(exec),
        arrivals_(exec),
        costs_(exec),
        is_wide_(exec),
        place_(exec),
        codes_(exec),
        order_(exec),
        bounds_(exec) {}
  ///@}

  /// A new tree over [n] boxes.
  void build(E& exec, span<box const> boxes);
  /// For the same number of boxes as the last build.
  void refit(E& exec, span<box const> boxes);
  /// Until the next build or refit.
  bvh_view view() const { return {nodes_.data(), count_}; }

 private:
  buffer<bvh_node, E> nodes_;
  buffer<bvh_kernels::binary_node, E> binary_;
  buffer<u32, E> leaf_up_;  // by sorted position: parent << 1 | side
  buffer<u32, E> arrivals_;
  buffer<bvh_kernels::wide_costs, E> costs_;
  buffer<u32, E> is_wide_;  // by binary node
  buffer<u32, E> place_;
  buffer<u64, E> codes_;
  buffer<u32, E> order_;
  buffer<box, E> bounds_;
  index_t count_ = 0;
};

}}  // namespace gart::GART_ISA

#include <gart/bvh/bvh_impl.hpp>
