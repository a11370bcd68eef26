#pragma once
// Visits the leaves of a BVH that a ray may meet between two distances, nearer nodes first. The visitor says what is of
// interest, and may narrow it as it goes:
//   float near(), far();    only boxes the ray crosses somewhere in [near, far] are entered; 0 or more
//   void leaf(u32 box);     every box that the ray crosses there, once, and some that it just misses
// Any ray type with a unit `direction` and an origin_of(ray). Who asks for the boxes themselves tests what is proposed
// with crosses(box, ...).

#include <gart/bvh/bvh.hpp>

namespace gart {

// A finite inverse of every direction, so that 0 * inf never makes a slab test lie.
GART_HD GART_INLINE float slab_inverse(float d) {
  float const tiny = 1e-20f;
  return 1.0f / (d < tiny && d > -tiny ? (d < 0 ? -tiny : tiny) : d);
}

struct slab_ray {
  vec3 origin, inverse;
  template <class Ray>
  GART_HD GART_INLINE explicit slab_ray(Ray const& r)
      : origin(origin_of(r)),
        inverse(slab_inverse(r.direction.x), slab_inverse(r.direction.y), slab_inverse(r.direction.z)) {}
};

// Whether the ray crosses the box somewhere in [near, far].
GART_HD GART_INLINE bool crosses(box const& b, slab_ray const& r, float near, float far) {
  for (int k = 0; k < 3; ++k) {
    float const t0 = (b.lo[k] - r.origin[k]) * r.inverse[k], t1 = (b.hi[k] - r.origin[k]) * r.inverse[k];
    near = fmaxf(near, fminf(t0, t1)), far = fminf(far, fmaxf(t0, t1));
  }
  return near <= far && b.lo.x <= b.hi.x;
}

// b where a is not a number.
GART_HD GART_INLINE float larger(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fmaxf(a, b);
#else
  return a > b ? a : b;
#endif
}
GART_HD GART_INLINE float smaller(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fminf(a, b);
#else
  return a < b ? a : b;
#endif
}

// A node's grid along a ray: it crosses plane q of axis k at q * step[k] + enter[k], or + leave[k] on the way out. The
// two lie apart by more than all roundings of either: a few of the distance to the far end of the grid. What overflows
// ends as an infinity on the safe side or as no number, and that prunes nothing.
struct grid_crossing {
  float step[3], enter[3], leave[3];

  GART_HD GART_INLINE grid_crossing(bvh_node const& n, slab_ray const& r) {
    GART_UNROLL
    for (int k = 0; k < 3; ++k) {
      bvh_axis const a = n.axis(k);
      float const begin = (a.origin - r.origin[k]) * r.inverse[k];
      step[k] = a.step() * r.inverse[k];
      float const slack = 4.8e-7f * (fabsf(begin) + 256.0f * fabsf(step[k]));
      enter[k] = begin - slack, leave[k] = begin + slack;
    }
  }
};

// The children that the ray crosses somewhere in [near, far], a bit each; entry: where it enters them, at least near.
GART_HD GART_INLINE u32 cross_children(bvh_node const& n, slab_ray const& r, float near, float far,
                                       float (&entry)[bvh_width]) {
  grid_crossing const grid(n, r);
  u32 crossed = 0;
#if defined(__CUDA_ARCH__)
  u32 first[3][bvh_width / 4], last[3][bvh_width / 4];
  GART_UNROLL
  for (int k = 0; k < 3; ++k) GART_UNROLL
  for (int w = 0; w < bvh_width / 4; ++w) {
    u32 const lower = n.plane[0][k][w], upper = n.plane[1][k][w];
    first[k][w] = r.inverse[k] < 0 ? upper : lower, last[k][w] = r.inverse[k] < 0 ? lower : upper;
  }
  auto const byte_of = [](u32 const(&side)[bvh_width / 4], int c) {
    return static_cast<float>(side[c / 4] >> 8 * (c % 4) & 0xffu);
  };
#else
  u8 const* first[3];
  u8 const* last[3];
  for (int k = 0; k < 3; ++k) {
    bool const backwards = r.inverse[k] < 0;
    first[k] = reinterpret_cast<u8 const*>(n.plane[backwards][k]);
    last[k] = reinterpret_cast<u8 const*>(n.plane[!backwards][k]);
  }
  auto const byte_of = [](u8 const* side, int c) { return static_cast<float>(side[c]); };
#endif
  GART_UNROLL
  for (int c = 0; c < bvh_width; ++c) {
    float from = near, to = far;
    GART_UNROLL
    for (int k = 0; k < 3; ++k) {
      from = larger(fma(byte_of(first[k], c), grid.step[k], grid.enter[k]), from);
      to = smaller(fma(byte_of(last[k], c), grid.step[k], grid.leave[k]), to);
    }
    entry[c] = from;
    crossed |= (from <= to ? 1u : 0u) << c;
  }
  return crossed;
}

// Where the ray enters child c, at least near: what cross_children gave for it.
GART_HD GART_INLINE float enter_child(bvh_node const& n, int c, slab_ray const& r, float near) {
  grid_crossing const grid(n, r);
  float from = near;
  GART_UNROLL
  for (int k = 0; k < 3; ++k) {
    u8 const plane = reinterpret_cast<u8 const*>(n.plane[r.inverse[k] < 0][k])[c];
    from = larger(fma(static_cast<float>(plane), grid.step[k], grid.enter[k]), from);
  }
  return from;
}

GART_HD GART_INLINE int lowest_bit(u32 bits) {
#if defined(__CUDA_ARCH__)
  return __ffs(static_cast<int>(bits)) - 1;
#else
  return __builtin_ctz(bits);
#endif
}

// A distance to sort by: its last 3 bits make room for a child's number.
GART_HD GART_INLINE u32 distance_key(float entry) { return float_to_bits(larger(entry, 0.0f)) & ~7u; }

// The children in `wanted` by distance, nearest in the lowest bits: 4 bits each, 8 + c, so that 0 is none left.
GART_HD GART_INLINE u32 near_to_far(u32 wanted, float const (&entry)[bvh_width]) {
  u32 order = 0;
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

template <class Ray, class Visitor>
GART_HD GART_INLINE void walk(bvh_view const& tree, Ray const& r, Visitor& visitor) {
  if (tree.count == 0) return;
  // 63 bits of code and at most 32 of position bound the depth; a level leaves at most one node with children to enter.
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
    u32 const crossed = cross_children(n, slab, visitor.near(), visitor.far(), entry);
    for (u32 leaves = crossed & n.leaf_mask(); leaves != 0; leaves &= leaves - 1)
      visitor.leaf(n.child[lowest_bit(leaves)]);
    u32 order = near_to_far(crossed & n.inner_mask(), entry);
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

}  // namespace gart
