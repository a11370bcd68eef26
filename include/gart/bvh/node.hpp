#pragma once
/// \file
/// One node of the wide tree: up to bvh_width children. Their boxes have 8 bits a side on the node's own grid. Source:
/// Ylitie, Karras and Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", HPG 2017.
///
/// Plane q of an axis lies at origin + q * step. The step is a power of two and the origin a multiple of it. So every
/// plane is exactly a float. Sides are rounded outward: a box lies in its child_box, whatever its size and place. An
/// axis with a side beyond 2^126, or one that is not a number, has planes for "below 0", 0 and "above 0" only.
///
/// 96 bytes at width 8, three sectors of a GPU's memory; loaded as 16-byte words.

#include <gart/bvh/box.hpp>

#include <bit>

namespace gart { inline namespace GART_ISA {

inline constexpr int bvh_width = 8;  ///< children of a node, at most

static_assert(std::endian::native == std::endian::little);  // child c of a side is byte c of its words

/// The grid of one axis.
struct bvh_axis {
  /// The exponent of an axis whose planes are "below 0", 0 and "above 0".
  static constexpr u32 unbounded = 254;
  float origin;  ///< of plane 0
  u32 exponent;  ///< of the step, biased by 127: 1 to 254

  /// From plane to plane.
  GART_HD float step() const { return bits_to_float(exponent << 23); }
};

/// A node, in three sectors of a GPU's memory.
struct alignas(32) bvh_node {
  float origin[3];                 ///< of plane 0, an axis each
  u32 shape;                       ///< a byte an axis: exponents of the steps; then 4 bits each: inner children, leaves
  u32 plane[2][3][bvh_width / 4];  ///< lower and upper sides; byte c is child c's
  u32 child[bvh_width];            ///< inner children (nodes) from the front, leaves (boxes) from the back

  /// The grid of axis k.
  GART_HD bvh_axis axis(int k) const { return {origin[k], shape >> 8 * k & 0xffu}; }
  ///@{
  /// Children of the kind.
  GART_HD int inner_count() const { return static_cast<int>(shape >> 24 & 0xfu); }
  GART_HD int leaf_count() const { return static_cast<int>(shape >> 28); }
  ///@}
  /// Bit c is child c.
  GART_HD u32 inner_mask() const { return (1u << inner_count()) - 1u; }
  /// Bit c is child c.
  GART_HD u32 leaf_mask() const { return ((1u << leaf_count()) - 1u) << (bvh_width - leaf_count()); }
  /// A ray is tested against this in place of the child's own box.
  GART_HD box child_box(int c) const {
    box out;
    for (int k = 0; k < 3; ++k) {
      bvh_axis const a = axis(k);
      u32 const lower = plane[0][k][c / 4] >> 8 * (c % 4) & 0xffu, upper = plane[1][k][c / 4] >> 8 * (c % 4) & 0xffu;
      bool const below_all = a.exponent == bvh_axis::unbounded && lower == 0;
      out.lo[k] = below_all ? -infinity : a.origin + static_cast<float>(lower) * a.step();
      out.hi[k] = a.origin + static_cast<float>(upper) * a.step();
    }
    return out;
  }
};

/// Whole steps at or below x; at or above x. Multiplying by a power of two is exact but where it underflows, which the
/// comparison makes up for.
GART_HD GART_INLINE float steps_below(float x, float step, float per_step) {
  float const n = floorf(x * per_step);
  return n * step > x ? n - 1.0f : n;
}
/// Whole steps at or above x.
GART_HD GART_INLINE float steps_above(float x, float step, float per_step) {
  float const n = ceilf(x * per_step);
  return n * step < x ? n + 1.0f : n;
}

/// The finest grid that reaches from lo to hi in 255 steps, each plane of it a float.
GART_HD GART_INLINE bvh_axis axis_between(float lo, float hi) {
  float const most = bits_to_float((127 + 126) << 23);
  if (!(lo >= -most && lo <= hi && hi <= most)) return {-bits_to_float(254 << 23), bvh_axis::unbounded};
  u32 const reach = float_to_bits(fmaxf(fabsf(lo), fabsf(hi))) >> 23, extent = float_to_bits(fabsf(hi - lo)) >> 23;
  // No side is past 2^23 steps, and 2^(extent + 1) is past all of them.
  u32 exponent = reach > 22 ? reach - 22 : 0;
  if (extent > exponent + 7) exponent = extent - 7;
  if (exponent == 0) exponent = 1;
  for (;; ++exponent) {
    float const step = bits_to_float(exponent << 23), per_step = bits_to_float((254 - exponent) << 23);
    float const below = steps_below(lo, step, per_step);
    if (steps_above(hi, step, per_step) - below <= 255.0f) return {below * step, exponent};
  }
}

/// The planes that hold [lo, hi], which lies within the axis's range. A side that is not a number holds all.
GART_HD GART_INLINE u32 plane_below(bvh_axis const& a, float lo) {
  if (a.exponent == bvh_axis::unbounded) return lo >= 0.0f ? 1 : 0;
  float const step = a.step(), per_step = bits_to_float((254 - a.exponent) << 23);
  float const q = steps_below(lo, step, per_step) - a.origin * per_step;
  return q > 0.0f ? static_cast<u32>(q) : 0;
}
/// The plane above: at or above hi.
GART_HD GART_INLINE u32 plane_above(bvh_axis const& a, float hi) {
  if (a.exponent == bvh_axis::unbounded) return hi <= 0.0f ? 1 : 255;
  float const step = a.step(), per_step = bits_to_float((254 - a.exponent) << 23);
  float const q = steps_above(hi, step, per_step) - a.origin * per_step;
  return q < 255.0f ? static_cast<u32>(q) : 255;
}

}}  // namespace gart::GART_ISA
