#pragma once
/// \file
/// A ray and a node: which children's boxes it crosses, all of them at once.

#include <gart/bvh/node.hpp>

#if !defined(__CUDACC__) && defined(__AVX2__)
#include <immintrin.h>
#endif

namespace gart { inline namespace GART_ISA {

/// A finite inverse of every direction, so that 0 * inf never makes a slab test lie.
GART_HD GART_INLINE float slab_inverse(float d) {
  float const tiny = 1e-20f;
  return 1.0f / (d < tiny && d > -tiny ? (d < 0 ? -tiny : tiny) : d);
}

/// A ray in the frame of a tree, and by how much the tree's boxes are too narrow for it. Boxes of Gaussians are as wide
/// as rounding needs for rays from the frame (ellipsoid_box). Rays from elsewhere need 32 roundings of their origin
/// more.
struct placed_ray {
  vec3 origin;     ///< in the tree's frame
  vec3 direction;  ///< of the ray
  float pad;       ///< length that boxes are to be wider by, on each side
};

/// A ray of the tree's own frame (primary_ray), or from anywhere in it (ray).
template <class Ray>
GART_HD GART_INLINE placed_ray place(Ray const& r) {
  vec3 const o = origin_of(r);
  return {o, r.direction, std::is_same_v<Ray, ray> ? 4e-6f * (fabsf(o.x) + fabsf(o.y) + fabsf(o.z)) : 0.0f};
}

/// A ray as boxes are tested against it.
struct slab_ray {
  vec3 origin, inverse;  ///< and one over each part of the direction
  /// What boxes are to be wider by, along the ray, and negative: x - 0 is x, and costs primary rays nothing.
  vec3 narrower{0.0f};
  /// Of a ray in the tree's frame.
  GART_HD GART_INLINE explicit slab_ray(placed_ray const& r)
      : origin(r.origin),
        inverse(slab_inverse(r.direction.x), slab_inverse(r.direction.y), slab_inverse(r.direction.z)),
        narrower(-r.pad * fabsf(inverse.x), -r.pad * fabsf(inverse.y), -r.pad * fabsf(inverse.z)) {}
  /// The same.
  template <class Ray>
  GART_HD GART_INLINE explicit slab_ray(Ray const& r) : slab_ray(place(r)) {}
};

/// Whether the ray crosses the box somewhere in [near, far].
GART_HD GART_INLINE bool crosses(box const& b, slab_ray const& r, float near, float far) {
  for (int k = 0; k < 3; ++k) {
    float const t0 = (b.lo[k] - r.origin[k]) * r.inverse[k], t1 = (b.hi[k] - r.origin[k]) * r.inverse[k];
    near = fmaxf(near, fminf(t0, t1)), far = fminf(far, fmaxf(t0, t1));
  }
  return near <= far && b.lo.x <= b.hi.x;
}

/// b where a is not a number.
GART_HD GART_INLINE float larger(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fmaxf(a, b);
#else
  return a > b ? a : b;
#endif
}
/// b where a is not a number.
GART_HD GART_INLINE float smaller(float a, float b) {
#if defined(__CUDA_ARCH__)
  return fminf(a, b);
#else
  return a < b ? a : b;
#endif
}

/// A plane's number as rays read it. A device reads 1 + q / 2^15, whose bits need no conversion.
GART_HD GART_INLINE float plane_number(u32 q) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(0x3f800000u | q << 8);
#else
  return static_cast<float>(q);
#endif
}

/// That of child c, of the word of a side that has it.
GART_HD GART_INLINE float plane_in(u32 word, int c) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(__byte_perm(word, 0x3f800000u, 0x7604u | static_cast<u32>(c % 4) << 4));
#else
  return plane_number(word >> 8 * (c % 4) & 0xffu);
#endif
}

/// A node's grid along a ray. Where the ray enters, it crosses plane q of axis k at plane_number(q) * step[k] +
/// enter[k]. Where it leaves, at plane_number(q) * step[k] + leave[k]. The two lie apart by more than all roundings of
/// either. These are a few roundings of the distance to the far end of the grid. On a device there are also 2^-9 of a
/// step. What overflows ends as an infinity on the safe side or as no number, and that prunes nothing.
struct grid_crossing {
  float step[3], enter[3], leave[3];  ///< a number an axis

  /// Of a node and a ray.
  GART_HD GART_INLINE grid_crossing(bvh_node const& n, slab_ray const& r) {
    GART_UNROLL
    for (int k = 0; k < 3; ++k) {
      bvh_axis const a = n.axis(k);
      float const begin = (a.origin - r.origin[k]) * r.inverse[k];
      step[k] = a.step() * r.inverse[k];
      float const slack = 4.8e-7f * (fabsf(begin) + 256.0f * fabsf(step[k])) - r.narrower[k];
      enter[k] = begin - slack, leave[k] = begin + slack;
#if defined(__CUDA_ARCH__)
      float const more = 0.01f * fabsf(step[k]);
      step[k] *= 32768.0f;
      enter[k] = enter[k] - step[k] - more, leave[k] = leave[k] - step[k] + more;
#endif
    }
  }
};

/// What of a node a ray is tested against, in registers: 16 bytes at a time on a device.
#if defined(__CUDA_ARCH__)
GART_HD GART_INLINE bvh_node load_bounds(bvh_node const& n) {
  constexpr int quads = static_cast<int>((offsetof(bvh_node, child) + 15) / 16);
  quad words[quads];
  GART_UNROLL
  for (int q = 0; q < quads; ++q) words[q] = reinterpret_cast<quad const*>(&n)[q];
  bvh_node out;
  auto const word = [&](int i) { return words[i / 4].v[i % 4]; };
  GART_UNROLL
  for (int k = 0; k < 3; ++k) out.origin[k] = word(k);
  out.shape = float_to_bits(word(3));
  GART_UNROLL
  for (int i = 0; i < 6 * bvh_width / 4; ++i)
    out.plane[i / (3 * bvh_width / 4)][i / (bvh_width / 4) % 3][i % (bvh_width / 4)] = float_to_bits(word(4 + i));
  return out;
}
/// The same of its grid alone.
GART_HD GART_INLINE bvh_node load_grid(bvh_node const& n) {
  quad const head = reinterpret_cast<quad const*>(&n)[0];
  bvh_node out;
  GART_UNROLL
  for (int k = 0; k < 3; ++k) out.origin[k] = head.v[k];
  out.shape = float_to_bits(head.v[3]);
  return out;
}
#else
GART_HD GART_INLINE bvh_node const& load_bounds(bvh_node const& n) { return n; }
GART_HD GART_INLINE bvh_node const& load_grid(bvh_node const& n) { return n; }
#endif

/// The children that the ray crosses somewhere in [near, far], a bit each. `entry`: where it enters them, at least
/// near.
#if !defined(__CUDACC__) && defined(__AVX2__)
/// A child is a lane. Intrinsics stand where GCC finds no vector code for the language's words.
GART_INLINE u32 cross_children(bvh_node const& n, slab_ray const& r, float near, float far, float (&entry)[bvh_width]) {
  using floats = float __attribute__((vector_size(4 * bvh_width)));
  using ints = int __attribute__((vector_size(4 * bvh_width)));
  auto const planes = [](u32 const(&side)[bvh_width / 4]) {
    return __builtin_convertvector((ints)_mm256_cvtepu8_epi32(_mm_loadu_si64(side)), floats);
  };
  grid_crossing const grid(n, r);
  floats from = floats{} + near, to = floats{} + far;
  for (int k = 0; k < 3; ++k) {
    bool const backwards = r.inverse[k] < 0;
    floats const enter = planes(n.plane[backwards][k]) * grid.step[k] + grid.enter[k];
    floats const leave = planes(n.plane[!backwards][k]) * grid.step[k] + grid.leave[k];
    from = enter > from ? enter : from;
    to = leave < to ? leave : to;
  }
  std::memcpy(entry, &from, sizeof from);
  return static_cast<u32>(_mm256_movemask_ps((__m256)(from <= to)));
}
#else
GART_HD GART_INLINE u32 cross_children(bvh_node const& n, slab_ray const& r, float near, float far,
                                       float (&entry)[bvh_width]) {
  grid_crossing const grid(n, r);
  u32 first[3][bvh_width / 4], last[3][bvh_width / 4];
  GART_UNROLL
  for (int k = 0; k < 3; ++k) {
    GART_UNROLL
    for (int w = 0; w < bvh_width / 4; ++w) {
      u32 const lower = n.plane[0][k][w], upper = n.plane[1][k][w];
      first[k][w] = r.inverse[k] < 0 ? upper : lower, last[k][w] = r.inverse[k] < 0 ? lower : upper;
    }
  }
  u32 crossed = 0;
  GART_UNROLL
  for (int c = 0; c < bvh_width; ++c) {
    float from = near, to = far;
    GART_UNROLL
    for (int k = 0; k < 3; ++k) {
      from = larger(plane_in(first[k][c / 4], c) * grid.step[k] + grid.enter[k], from);
      to = smaller(plane_in(last[k][c / 4], c) * grid.step[k] + grid.leave[k], to);
    }
    entry[c] = from;
    crossed |= (from <= to ? 1u : 0u) << c;
  }
  return crossed;
}
#endif

/// Where the ray enters child c, at least near: the value of cross_children, to a rounding. Children are ordered by
/// that value, so another bound, even a closer one, would prune those behind it wrongly.
GART_HD GART_INLINE float enter_child(bvh_node const& n, int c, slab_ray const& r, float near) {
  grid_crossing const grid(n, r);
  float from = near;
  GART_UNROLL
  for (int k = 0; k < 3; ++k) {
    u8 const plane = reinterpret_cast<u8 const*>(n.plane[r.inverse[k] < 0][k])[c];
    from = larger(plane_number(plane) * grid.step[k] + grid.enter[k], from);
  }
  return from;
}

/// Whether the ray crosses child c somewhere in [near, far], and where it enters it: one of cross_children's. The words
/// of the sides, an axis each, where rays of this direction enter and leave.
GART_HD GART_INLINE bool cross_child(grid_crossing const& grid, int c, u32 const (&first)[3], u32 const (&last)[3],
                                     float near, float far, float& entry) {
  entry = near;
  GART_UNROLL
  for (int k = 0; k < 3; ++k) {
    entry = larger(plane_in(first[k], c) * grid.step[k] + grid.enter[k], entry);
    far = smaller(plane_in(last[k], c) * grid.step[k] + grid.leave[k], far);
  }
  return entry <= far;
}

}}  // namespace gart::GART_ISA
