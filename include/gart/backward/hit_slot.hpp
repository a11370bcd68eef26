#pragma once
/// \file
/// The content of a slot of the hit buffer, one struct a format. The forward pass packs it (of), the gather unpacks it.
/// The gradient of alpha needs V, the colour that the pixel would have if the hit were opaque (math/hit_gradient.hpp).
/// The gradient of colour needs the weight w = T alpha. It also needs to know which channels of the hit's colour were
/// clamped at zero.
///   float4   16 bytes  V, whose free sign bits hold the clamps; w
///   half      8 bytes  the same in four halves: V within 2^-11 relatively (2^-25 absolutely), at most 65504; 2^15 w,
///                      so that a weight keeps its 2^-11 down to 2e-9
///   weight    4 bytes  w, whose three lowest bits hold the clamps (a relative error of 2^-20); no V: enough for the
///                      gradient of colour (hybrid)
/// The gradient of alpha is the difference of V and the pixel's colour, over 1 - alpha. An error of V counts the more,
/// the less of the ray the hit and those behind it are. These are bounds of relative errors against double, of each
/// group of a whole gradient (tests/traits). On clouds and long rays they are 5e-4 for float4 and 1e-2 for half. On
/// stacks of hits at the clamp they are 5e-4 and 0.15. Slots that no hit wrote keep the bits of the clear, all set;
/// `written` tells them.

#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>
#include <gart/math/sh.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

// Three flags: what is clamped.
GART_HD GART_INLINE u32 clamps_of(vec3 const& c) {
  return (shows(c.x) ? 0u : 1u) | (shows(c.y) ? 0u : 2u) | (shows(c.z) ? 0u : 4u);
}

// The half nearest to x in [0, 65504], ties to even; and back.
GART_HD GART_INLINE u16 to_half(float x) {
  u32 const bits = float_to_bits(x);
  if (bits < 0x38800000u) return static_cast<u16>(float_to_bits(gart::add(x, 0.5f)) - 0x3f000000u);  // below 2^-14
  return static_cast<u16>((bits - 0x38000000u + 0xfffu + (bits >> 13 & 1u)) >> 13);
}
GART_HD GART_INLINE float from_half(u32 half) {
  return mul(bits_to_float(half << 13), 5.192296858534828e33f);
}  // 2^112

}  // namespace detail

/// The format float4: exact.
struct alignas(16) hit_entry {
  static constexpr char const* name = "float4";  ///< in configurations and reports
  float r, g, b;                                 ///< V; negative where the hit's colour was clamped
  float w;                                       ///< the weight; a NaN: not written

  /// Packs V, the weight and the clamps of the colour `c`, which is that before the clamp.
  GART_HD GART_INLINE static hit_entry of(vec3 const& v, float weight, vec3 const& c) {
    return {signed_by(v.x, c.x), signed_by(v.y, c.y), signed_by(v.z, c.z), weight};
  }
  /// Whether a hit wrote it, of a buffer that was cleared.
  GART_HD GART_INLINE bool written() const { return w >= 0.0f; }
  /// The weight, T alpha.
  GART_HD GART_INLINE float weight() const { return w; }
  /// Whether that channel of the hit's colour was clamped at zero.
  GART_HD GART_INLINE bool clamped(int channel) const {
    return float_to_bits(channel == 0 ? r : channel == 1 ? g : b) >> 31;
  }
  /// V.
  GART_HD GART_INLINE vec3 color() const { return {fabsf(r), fabsf(g), fabsf(b)}; }

  /// V, negative where c is.
  template <class F>
  GART_HD GART_INLINE static F signed_by(F v, F c) {
    F const size = magnitude(v);
    return select(shows(c), size, -size);
  }
};

/// The format half.
struct alignas(8) half_hit_entry {
  static constexpr char const* name = "half";  ///< in configurations and reports
  /// r in the low half of rg, b in that of bw, the weight in its high half. Sign bits of r, g, b: clamped.
  u32 rg, bw;

  /// As hit_entry::of.
  GART_HD GART_INLINE static half_hit_entry of(vec3 const& v, float weight, vec3 const& c) {
    u32 const clamps = detail::clamps_of(c);
    return {half_of(v.x) | half_of(v.y) << 16 | (clamps & 1u) << 15 | (clamps & 2u) << 30,
            half_of(v.z) | half_of(mul(weight, 32768.0f)) << 16 | (clamps & 4u) << 13};
  }
  /// Whether a hit wrote it, of a buffer that was cleared.
  GART_HD GART_INLINE bool written() const { return !(bw >> 31); }
  /// The weight, T alpha.
  GART_HD GART_INLINE float weight() const { return mul(detail::from_half(bw >> 16), 1.0f / 32768.0f); }
  /// Whether that channel of the hit's colour was clamped at zero.
  GART_HD GART_INLINE bool clamped(int channel) const {
    return (channel == 0 ? rg >> 15 : channel == 1 ? rg >> 31 : bw >> 15) & 1u;
  }
  /// V.
  GART_HD GART_INLINE vec3 color() const {
    return {detail::from_half(rg & 0x7fffu), detail::from_half(rg >> 16 & 0x7fffu), detail::from_half(bw & 0x7fffu)};
  }

 private:
  GART_HD GART_INLINE static u32 half_of(float x) { return detail::to_half(x < 65504.0f ? x : 65504.0f); }
};

/// The format weight: no V.
struct weight_entry {
  static constexpr char const* name = "weight";  ///< in configurations and reports
  float w;                                       ///< the weight, with the clamps in its lowest bits

  /// Packs the weight and the clamps of the colour `c`, which is that before the clamp.
  GART_HD GART_INLINE static weight_entry of(vec3 const&, float weight, vec3 const& c) {
    return {bits_to_float((float_to_bits(weight) & ~7u) | detail::clamps_of(c))};
  }
  /// Whether a hit wrote it, of a buffer that was cleared.
  GART_HD GART_INLINE bool written() const { return w >= 0.0f; }
  /// The weight, T alpha.
  GART_HD GART_INLINE float weight() const { return w; }
  /// Whether that channel of the hit's colour was clamped at zero.
  GART_HD GART_INLINE bool clamped(int channel) const { return float_to_bits(w) >> channel & 1; }
};

}}  // namespace gart::GART_ISA
