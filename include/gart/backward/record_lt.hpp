#pragma once
// What the primitive and hybrid strategies record of a hit, at its place in the LT buffer (tiles/layout.hpp). The
// weight w = T alpha stands for the transmittance T before the hit, which is w / alpha; with it goes, for each channel
// of the hit's colour, whether it was clamped at zero:
//   primitive  4 channels: the ray's colour with the hit (L), whose sign bits, free as L is not negative, hold the
//   clamps; w hybrid     1 channel: w, whose three lowest bits hold the clamps (a relative error of 2^-20)
// Slots that no hit wrote hold what the clear left there, a NaN, which `written` tells.

#include <gart/math/arith.hpp>
#include <gart/render/record.hpp>
#include <gart/tiles/layout.hpp>

namespace gart {

struct alignas(16) lt_entry {
  float r, g, b;  // L, this hit included; negative where the hit's colour was clamped
  float w;

  GART_HD GART_INLINE static lt_entry of(vec3 const& l, float weight, vec3 const& c) {
    return {signed_by(l.x, c.x), signed_by(l.y, c.y), signed_by(l.z, c.z), weight};
  }
  GART_HD GART_INLINE bool written() const { return w >= 0.0f; }
  GART_HD GART_INLINE float weight() const { return w; }
  GART_HD GART_INLINE bool clamped(int channel) const {
    return float_to_bits(channel == 0 ? r : channel == 1 ? g : b) >> 31;
  }
  GART_HD GART_INLINE vec3 color() const { return {fabsf(r), fabsf(g), fabsf(b)}; }

 private:
  GART_HD GART_INLINE static float signed_by(float l, float c) {
    return bits_to_float((float_to_bits(l) & 0x7fffffffu) | (c > 0 ? 0u : 0x80000000u));
  }
};

struct weight_entry {
  float w;

  GART_HD GART_INLINE static weight_entry of(vec3 const&, float weight, vec3 const& c) {
    u32 const clamps = (c.x > 0 ? 0u : 1u) | (c.y > 0 ? 0u : 2u) | (c.z > 0 ? 0u : 4u);
    return {bits_to_float((float_to_bits(weight) & ~7u) | clamps)};
  }
  GART_HD GART_INLINE bool written() const { return w >= 0.0f; }
  GART_HD GART_INLINE float weight() const { return w; }
  GART_HD GART_INLINE bool clamped(int channel) const { return float_to_bits(w) >> channel & 1; }
};

template <class Entry, int Size>
struct record_lt {
  using entry = Entry;
  lt_range const* ranges = nullptr;
  Entry* slots = nullptr;

  GART_HD GART_INLINE void operator()(pixel at, hit const& h, vec3 const& color, float weight,
                                      vec3 const& unclamped) const {
    lt_range const range = ranges[h.id];
    pixel_box const& b = range.box;
    u32 const x = static_cast<u32>(at.x), y = static_cast<u32>(at.y);
    if (x < b.x0 || x >= b.x1 || y < b.y0 || y >= b.y1) return;  // boxes hold every hit; memory stays safe regardless
    slots[lt_index<Size>(range, x, y)] = Entry::of(color, weight, unclamped);
  }

  static constexpr bool any = true;
  struct place {
    Entry* first;
    pixel_box cell;
  };
  place place_of(u32 id, pixel_box const& tile) const {
    lt_range const range = ranges[id];
    pixel_box const cell = intersect(range.box, tile);
    return {slots + range.offset + tile_offset(range.box, cell), cell};
  }
  GART_INLINE void operator()(place const& p, pixel at, vec3 const& color, float weight, vec3 const& unclamped) const {
    u32 const x = static_cast<u32>(at.x), y = static_cast<u32>(at.y);
    if (x < p.cell.x0 || x >= p.cell.x1 || y < p.cell.y0 || y >= p.cell.y1) return;
    p.first[pixel_offset(p.cell, x, y)] = Entry::of(color, weight, unclamped);
  }
};

}  // namespace gart
