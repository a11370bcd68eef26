#pragma once
/// \file
/// Rays that stay close together, as one beam. A beam crosses every child of a node that one of its rays crosses.
///
/// A beam runs along the axis that its rays run along most, all of them the same way. At depth s along that axis a ray
/// stands at origin + s slope on each other axis. The beam lies between the least and the greatest of these. It meets a
/// box in an interval of s, cut by four planes. So nothing is divided by a direction that changes its sign within the
/// beam. Distances along a ray are s times 1 / |direction| on the beam's axis.

#include <gart/bvh/cross.hpp>

namespace gart { inline namespace GART_ISA {

/// The bounds of its rays, by axis: first the beam's own, then the two others.
struct beam {
  int axis[3];                 ///< 0 to 2
  float forward;               ///< 1 or -1: which way rays run along the first axis
  float least_origin[3];       ///< of any ray
  float greatest_origin[3];    ///< of any ray
  float by_least_slope[2];     ///< one over it, on the two other axes; finite
  float by_greatest_slope[2];  ///< the same of the greatest slope
  float least_stretch;         ///< distance along a ray over depth, the least of any ray
  float greatest_stretch;      ///< the greatest of any ray
  float pad;                   ///< the greatest of any ray

  /// No ray is nearer than this at a distance along it.
  GART_HD GART_INLINE float depth_of(float distance) const { return distance / greatest_stretch; }
};

/// Of a number, or of a lane a child; b where a is not a number.
template <class F>
GART_HD GART_INLINE F larger_of(F a, F b) {
  if constexpr (std::is_same_v<F, float>)
    return larger(a, b);
  else
    return a > b ? a : b;
}
/// The same, the smaller.
template <class F>
GART_HD GART_INLINE F smaller_of(F a, F b) {
  if constexpr (std::is_same_v<F, float>)
    return smaller(a, b);
  else
    return a < b ? a : b;
}

/// The depths between which a beam can be in boxes, narrowed axis by axis. F: a float, or one a box.
template <class F>
struct beam_depths {
  F from, to;  ///< the beam is in the box nowhere else

  /// The sides of the boxes on axis k of the beam. The addition makes up for all roundings, here and in the bounds: a
  /// few of each number's size.
  GART_HD GART_INLINE void cut(beam const& b, int k, F lower, F upper, float extent) {
    float const least = b.least_origin[k], greatest = b.greatest_origin[k];
    float const slack = b.pad + 1e-6f * (extent + fabsf(least) + fabsf(greatest));
    if (k == 0) {
      bool const forward = b.forward > 0;
      from = larger_of(forward ? lower - (greatest + slack) : (least - slack) - upper, from);
      to = smaller_of(forward ? upper - (least - slack) : (greatest + slack) - lower, to);
      return;
    }
    // least + s slope <= upper, greatest + s slope >= lower.
    F const below = (upper - (least - slack)) * b.by_least_slope[k - 1];
    F const above = (lower - (greatest + slack)) * b.by_greatest_slope[k - 1];
    if (b.by_least_slope[k - 1] > 0)
      to = smaller_of(below, to);
    else
      from = larger_of(below, from);
    if (b.by_greatest_slope[k - 1] > 0)
      from = larger_of(above, from);
    else
      to = smaller_of(above, to);
  }
};

/// The same, given the planes of a node's grid. An axis without a grid to speak of cuts nothing.
template <class F>
GART_HD GART_INLINE void cut_by_planes(beam_depths<F>& depths, beam const& b, int k, bvh_axis const& a, F lower,
                                       F upper) {
  if (a.exponent == bvh_axis::unbounded) return;
  float const step = a.step();
  depths.cut(b, k, lower * step + a.origin, upper * step + a.origin, fabsf(a.origin) + 255.0f * step);
}

/// Whether a beam may cross child c at a depth of at least `near`. `entry`: no ray enters it before that distance.
GART_HD GART_INLINE bool crosses_child(bvh_node const& n, int c, beam const& b, float near, float& entry) {
  beam_depths<float> depths{near, infinity};
  GART_UNROLL
  for (int k = 0; k < 3; ++k) {
    int const axis = b.axis[k];
    auto const plane = [&](int side) { return static_cast<float>(n.plane[side][axis][c / 4] >> 8 * (c % 4) & 0xffu); };
    cut_by_planes(depths, b, k, n.axis(axis), plane(0), plane(1));
  }
  entry = depths.from * b.least_stretch * (1 - 2e-6f);
  return depths.from * (1 - 1e-6f) <= depths.to * (1 + 1e-6f);
}

/// All children at once: a bit each, and their entries.
#if !defined(__CUDACC__) && defined(__AVX2__)
GART_INLINE u32 cross_children(bvh_node const& n, beam const& b, float near, float (&entry)[bvh_width]) {
  using floats = float __attribute__((vector_size(4 * bvh_width)));
  using ints = int __attribute__((vector_size(4 * bvh_width)));
  auto const planes = [](u32 const(&side)[bvh_width / 4]) {
    return __builtin_convertvector((ints)_mm256_cvtepu8_epi32(_mm_loadu_si64(side)), floats);
  };
  beam_depths<floats> depths{floats{} + near, floats{} + infinity};
  for (int k = 0; k < 3; ++k) {
    int const axis = b.axis[k];
    cut_by_planes(depths, b, k, n.axis(axis), planes(n.plane[0][axis]), planes(n.plane[1][axis]));
  }
  floats const enter = depths.from * (b.least_stretch * (1 - 2e-6f));
  std::memcpy(entry, &enter, sizeof enter);
  return static_cast<u32>(_mm256_movemask_ps((__m256)(depths.from * (1 - 1e-6f) <= depths.to * (1 + 1e-6f)))) &
         (n.inner_mask() | n.leaf_mask());
}
#else
GART_HD GART_INLINE u32 cross_children(bvh_node const& n, beam const& b, float near, float (&entry)[bvh_width]) {
  u32 crossed = 0;
  for (int c = 0; c < bvh_width; ++c) crossed |= (crosses_child(n, c, b, near, entry[c]) ? 1u : 0u) << c;
  return crossed & (n.inner_mask() | n.leaf_mask());
}
#endif

}}  // namespace gart::GART_ISA
