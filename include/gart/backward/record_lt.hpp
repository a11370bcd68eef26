#pragma once
// What the primitive and hybrid strategies record of a hit, at its place in the LT buffer (tiles/layout.hpp):
// primitive: 4 channels, the ray's colour with the hit (L) and its transmittance before it (T); hybrid: T alone.
// Slots that no hit wrote hold what the clear left there, a NaN, which `written` tells.

#include <gart/render/record.hpp>
#include <gart/tiles/layout.hpp>

namespace gart {

struct alignas(16) lt_entry {
  float r, g, b;  // L, this hit included
  float t;        // T before this hit
};

GART_HD GART_INLINE float transmittance_of(lt_entry const& e) { return e.t; }
GART_HD GART_INLINE float transmittance_of(float t) { return t; }
GART_HD GART_INLINE bool written(float t) { return t >= 0.0f; }

template <class Entry, int Size>
struct record_lt {
  using entry = Entry;
  lt_range const* ranges = nullptr;
  Entry* slots = nullptr;

  GART_HD GART_INLINE void operator()(pixel at, hit const& h, vec3 const& color, float before) const {
    lt_range const range = ranges[h.id];
    pixel_box const& b = range.box;
    u32 const x = static_cast<u32>(at.x), y = static_cast<u32>(at.y);
    if (x < b.x0 || x >= b.x1 || y < b.y0 || y >= b.y1) return;  // boxes hold every hit; memory stays safe regardless
    if constexpr (sizeof(Entry) == sizeof(float))
      slots[lt_index<Size>(range, x, y)] = before;
    else
      slots[lt_index<Size>(range, x, y)] = {color.x, color.y, color.z, before};
  }
};

}  // namespace gart
