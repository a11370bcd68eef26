#pragma once
/// \file
/// The binary tree that a wide one is made from. Source: Karras, "Maximizing parallelism in the construction of BVHs,
/// octrees, and k-d trees", HPG 2012. Boxes are sorted by the Morton codes of their centres. One thread makes an inner
/// node; boxes are fitted from the leaves up. Codes are made for the bulk of the centres: one far away would leave the
/// others few bits. As they are fitted it is also worked out which nodes become wide ones (bvh/shares.hpp).

#include <gart/bvh/morton.hpp>
#include <gart/bvh/shares.hpp>
#include <gart/core/span.hpp>
#include <gart/exec/concepts.hpp>

namespace gart { inline namespace GART_ISA { namespace bvh_kernels {

// Both children's boxes lie in their parent.
struct alignas(16) binary_node {
  static constexpr u32 leaf = 0x80000000u;
  float lo[2][3], hi[2][3];
  u32 child[2];  // a node, or leaf | index of the box
  u32 up;        // parent << 1 | side; the root's is 0
  u32 shares;    // wide_shares

  GART_HD box child_box(int c) const {
    return {vec3(lo[c][0], lo[c][1], lo[c][2]), vec3(hi[c][0], hi[c][1], hi[c][2])};
  }
};

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

// The bulk of the centres, robust against strays, which spoil no more than their own partial box. Per axis: the lower
// quartile of the partial boxes' least corners, and the upper quartile of their greatest. Thread i asks whether one of
// them is the one wanted. Its place is the number of smaller ones, and of equal ones before it.
struct find_bulk {
  span<box const> partial;
  span<box> bulk;
  // Nor is it empty, or none of numbers.
  GART_HD static bool counts(box const& b, index_t axis) {
    return b.lo[static_cast<int>(axis)] <= b.hi[static_cast<int>(axis)];
  }
  GART_HD static float corner(box const& b, index_t side, index_t axis) {
    return side ? b.hi[static_cast<int>(axis)] : b.lo[static_cast<int>(axis)];
  }
  GART_KERNEL void operator()(index_t i) const {
    index_t const axis = i % 3, side = i / 3 % 2, mine = i / 6;
    if (!counts(partial[mine], axis)) return;
    float const value = corner(partial[mine], side, axis);
    index_t less = 0, filled = 0;
    for (index_t k = 0; k < partial.size(); ++k) {
      if (!counts(partial[k], axis)) continue;
      float const other = corner(partial[k], side, axis);
      less += other < value || (other == value && k < mine), ++filled;
    }
    if (less != (side ? filled - 1 - filled / 4 : filled / 4)) return;
    (side ? bulk[0].hi : bulk[0].lo)[static_cast<int>(axis)] = value;
  }
};

// What codes are made for: the box of all centres, cut off at so many sizes of the bulk. Those beyond go to its edge.
struct bound_codes {
  static constexpr float reach = 256;
  span<box const> partial, bulk;
  span<box> bounds;
  GART_KERNEL void operator()(index_t) const {
    box all = empty_box();
    for (box const& b : partial) all = join(all, b);
    for (int k = 0; k < 3; ++k) {
      if (!(all.lo[k] <= all.hi[k])) continue;  // no centre, and no bulk
      float const lo = bulk[0].lo[k], hi = bulk[0].hi[k], far = mul(reach, add(hi, -lo));
      if (!(far > 0)) continue;  // as where most are in one place
      all.lo[k] = fmaxf(all.lo[k], add(lo, -far)), all.hi[k] = fminf(all.hi[k], add(hi, far));
    }
    bounds[0] = all;
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
  span<binary_node> nodes;
  span<u32> leaf_up;
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
        nodes[index].child[side] = binary_node::leaf | order[child];
        leaf_up[child] = index << 1 | side;
      } else {
        nodes[index].child[side] = static_cast<u32>(child);
        nodes[child].up = index << 1 | side;
      }
    }
    if (index == 0) nodes[0].up = 0;
  }
};

// A single box has no inner node to split; the root holds it beside nothing.
struct link_single {
  span<binary_node> nodes;
  span<u32> leaf_up;
  GART_KERNEL void operator()(index_t) const {
    binary_node& root = nodes[0];
    root.child[0] = root.child[1] = binary_node::leaf;
    root.up = 0;
    for (int k = 0; k < 3; ++k) root.lo[1][k] = infinity, root.hi[1][k] = -infinity;
    leaf_up[0] = 0;
  }
};

// From every leaf up: boxes, and what wide nodes would cost (bvh/shares.hpp).
template <execution E>
struct fit {
  span<box const> boxes;
  span<u32 const> order;
  span<u32 const> leaf_up;
  span<binary_node> nodes;
  span<wide_costs> costs;
  span<u32> arrivals;
  GART_KERNEL void operator()(index_t i) const {
    box b = boxes[order[i]];
    wide_costs cost{};
    u32 up = leaf_up[i];
    for (;;) {
      u32 const index = up >> 1, side = up & 1;
      binary_node& here = nodes[index];
      for (int k = 0; k < 3; ++k) here.lo[side][k] = b.lo[k], here.hi[side][k] = b.hi[k];
      E::fence();
      // The second child to arrive goes on with the union.
      if (boxes.size() > 1 && E::atomic_add(&arrivals[index], 1u) == 0) return;
      E::fence();
      binary_node const volatile& n = here;
      for (int k = 0; k < 3; ++k) {
        float const lo = n.lo[1 - side][k], hi = n.hi[1 - side][k];
        b.lo[k] = b.lo[k] < lo ? b.lo[k] : lo;
        b.hi[k] = b.hi[k] > hi ? b.hi[k] : hi;
      }
      u32 const other = n.child[1 - side];
      wide_costs beside{};
      if (!(other & binary_node::leaf)) {
        wide_costs const volatile& from = costs[other];
        for (int k = 0; k < bvh_width; ++k) beside.of[k] = from.of[k];
      }
      wide_shares shares;
      cost = costs_of(half_area(b), side == 0 ? cost : beside, side == 0 ? beside : cost, shares);
      here.shares = shares.bits;
      if (index == 0) return;
      costs[index] = cost;
      up = n.up;
    }
  }
};

}}}  // namespace gart::GART_ISA::bvh_kernels
