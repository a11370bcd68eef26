#pragma once
// Template bodies of bvh.hpp.

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/bvh/bvh.hpp>
#include <gart/bvh/morton.hpp>

namespace gart {
namespace bvh_kernels {

GART_HD GART_INLINE bool is_empty(box const& b) { return b.lo.x > b.hi.x; }

// One stage of a reduction to the box of all box centres: thread i joins boxes i, i + threads, ...
struct bound_centers {
  span<box const> boxes;
  span<box> partial;
  bool centers;
  GART_KERNEL void operator()(index_t i) const {
    box all = empty_box();
    for (std::size_t k = i; k < boxes.size(); k += partial.size()) {
      box b = boxes[k];
      if (is_empty(b)) continue;
      if (centers) b.lo = b.hi = 0.5f * b.lo + 0.5f * b.hi;
      all = join(all, b);
    }
    partial[i] = all;
  }
};

struct encode {
  span<box const> boxes;
  span<box const> bounds;
  span<u64> codes;
  span<u32> order;
  GART_KERNEL void operator()(index_t i) const {
    box const b = boxes[i];
    // Empty boxes go last and together, where they disturb no other node.
    codes[i] = is_empty(b) ? (u64{1} << morton_bits) - 1 : morton_code(0.5f * b.lo + 0.5f * b.hi, bounds[0]);
    order[i] = i;
  }
};

// Length of the common prefix of the codes at i and j, ties broken by position; -1 outside.
struct prefix {
  u64 const* codes;
  int n;
  GART_HD static int leading_zeros(u64 x) {
#if defined(__CUDA_ARCH__)
    return __clzll(static_cast<long long>(x));
#else
    return x ? __builtin_clzll(x) : 64;
#endif
  }
  GART_HD int operator()(int i, int j) const {
    if (j < 0 || j >= n) return -1;
    u64 const difference = codes[i] ^ codes[j];
    return difference ? leading_zeros(difference) : 64 + leading_zeros(static_cast<u64>(i ^ j));
  }
};

// Karras 2012, figure 4: the range of inner node i and where it splits.
struct link {
  span<u64 const> codes;
  span<u32 const> order;
  span<bvh_node> nodes;
  span<u32> leaf_parent;
  GART_KERNEL void operator()(index_t index) const {
    int const n = static_cast<int>(codes.size()), i = static_cast<int>(index);
    prefix const common{codes.data(), n};
    int const direction = common(i, i + 1) > common(i, i - 1) ? 1 : -1;
    int const least = common(i, i - direction);
    int reach = 2;
    while (common(i, i + reach * direction) > least) reach *= 2;
    int length = 0;
    for (int step = reach / 2; step >= 1; step /= 2)
      if (common(i, i + (length + step) * direction) > least) length += step;
    int const j = i + length * direction;
    int const node_prefix = common(i, j);
    int split = 0;
    for (int divisor = 2, step = (length + 1) / 2;; divisor *= 2, step = (length + divisor - 1) / divisor) {
      if (common(i, i + (split + step) * direction) > node_prefix) split += step;
      if (step <= 1) break;
    }
    int const gamma = i + split * direction + (direction < 0 ? direction : 0);
    int const first = i < j ? i : j, last = i < j ? j : i;
    for (int side = 0; side < 2; ++side) {
      int const child = gamma + side;
      bool const is_leaf = side == 0 ? first == gamma : last == gamma + 1;
      if (is_leaf) {
        nodes[index].child[side] = bvh_node::leaf | order[child];
        leaf_parent[child] = index << 1 | side;
      } else {
        nodes[index].child[side] = static_cast<u32>(child);
        nodes[child].parent = index << 1 | side;
      }
    }
    if (index == 0) nodes[0].parent = 0;
  }
};

// A single box has no inner node to split; the root holds it beside nothing.
struct link_single {
  span<bvh_node> nodes;
  span<u32> leaf_parent;
  GART_KERNEL void operator()(index_t) const {
    nodes[0].child[0] = nodes[0].child[1] = bvh_node::leaf;
    nodes[0].parent = 0;
    nodes[0].set_child_box(1, empty_box());
    leaf_parent[0] = 0;
  }
};

// From every leaf up; the second child to arrive at a node goes on with the union.
template <execution E>
struct fit {
  span<box const> boxes;
  span<u32 const> order;
  span<bvh_node> nodes;
  span<u32 const> leaf_parent;
  span<u32> arrivals;
  GART_KERNEL void operator()(index_t i) const {
    box b = boxes[order[i]];
    u32 up = leaf_parent[i];
    for (;;) {
      u32 const node = up >> 1;
      nodes[node].set_child_box(static_cast<int>(up & 1), b);
      if (nodes.size() == 1 && boxes.size() == 1) return;
      E::fence();
      if (E::atomic_add(&arrivals[node], 1u) == 0) return;
      E::fence();
      if (node == 0) return;
      bvh_node const volatile& n = nodes[node];
      box joined = b;
      int const other = static_cast<int>(~up & 1);
      for (int k = 0; k < 3; ++k) {
        joined.lo[k] = joined.lo[k] < n.lo[other][k] ? joined.lo[k] : n.lo[other][k];
        joined.hi[k] = joined.hi[k] > n.hi[other][k] ? joined.hi[k] : n.hi[other][k];
      }
      b = joined;
      up = n.parent;
    }
  }
};

}  // namespace bvh_kernels

template <execution E>
void bvh<E>::build(E& exec, span<box const> boxes) {
  count_ = static_cast<index_t>(boxes.size());
  if (count_ == 0) return;
  stage_scope stage(exec, "bvh build");
  constexpr index_t wide = 16384, narrow = 128;
  bounds_.resize(wide + narrow + 1);
  codes_.resize(count_), order_.resize(count_), leaf_parent_.resize(count_);
  nodes_.resize(count_ > 1 ? count_ - 1 : 1);
  span<box> const all = bounds_.view();
  span<box> const stage1 = all.subspan(0, wide), stage2 = all.subspan(wide, narrow),
                  root = all.subspan(wide + narrow, 1);
  parallel_for(exec, "bvh/bounds", wide, bvh_kernels::bound_centers{boxes, stage1, true});
  parallel_for(exec, "bvh/bounds", narrow, bvh_kernels::bound_centers{stage1, stage2, false});
  parallel_for(exec, "bvh/bounds", 1, bvh_kernels::bound_centers{stage2, root, false});
  parallel_for(exec, "bvh/codes", count_, bvh_kernels::encode{boxes, root, codes_, order_});
  sort_pairs(exec, codes_.view(), order_.view(), morton_bits);
  if (count_ > 1)
    parallel_for(exec, "bvh/link", count_ - 1, bvh_kernels::link{codes_, order_, nodes_, leaf_parent_});
  else
    parallel_for(exec, "bvh/link", 1, bvh_kernels::link_single{nodes_, leaf_parent_});
  refit(exec, boxes);
}

template <execution E>
void bvh<E>::refit(E& exec, span<box const> boxes) {
  if (boxes.size() != count_) throw invalid_argument("bvh::refit: as many boxes as the tree was built over are needed");
  if (count_ == 0) return;
  arrivals_.resize(nodes_.size());
  arrivals_.zero();
  parallel_for(exec, "bvh/fit", count_, bvh_kernels::fit<E>{boxes, order_, nodes_, leaf_parent_, arrivals_});
}

}  // namespace gart
