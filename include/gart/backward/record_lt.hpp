#pragma once
// What the primitive and hybrid strategies record of a hit: a slot (backward/lt_slot.hpp) at its place in the LT buffer
// (tiles/layout.hpp).

#include <gart/backward/lt_slot.hpp>
#include <gart/render/record.hpp>
#include <gart/tiles/layout.hpp>

namespace gart {

template <class Entry, int Size>
struct record_lt {
  using entry = Entry;
  lt_range const* ranges = nullptr;
  Entry* slots = nullptr;

  static constexpr bool any = true;
  // The number of the hit's slot. Boxes hold every hit; memory stays safe regardless.
  GART_HD GART_INLINE u32 place_of(u32 id, pixel at) const {
    lt_range const range = ranges[id];
    pixel_box const& b = range.box;
    u32 const x = static_cast<u32>(at.x), y = static_cast<u32>(at.y);
    if (x < b.x0 || x >= b.x1 || y < b.y0 || y >= b.y1) return slot_cell::none;
    return static_cast<u32>(lt_index<Size>(range, x, y));
  }
  GART_HD GART_INLINE void operator()(u32 place, vec3 const& opaque, float weight, vec3 const& unclamped) const {
    if (place != slot_cell::none) slots[place] = Entry::of(opaque, weight, unclamped);
  }

  struct cell {
    Entry* first;
    pixel_box pixels;
  };
  cell cell_of(u32 id, pixel_box const& tile) const {
    lt_range const range = ranges[id];
    pixel_box const pixels = intersect(range.box, tile);
    return {slots + range.offset + tile_offset(range.box, pixels), pixels};
  }
  u32 place_of(cell const& c, pixel at) const {
    return static_cast<u32>(c.first - slots) + pixel_offset(c.pixels, static_cast<u32>(at.x), static_cast<u32>(at.y));
  }
  GART_INLINE void operator()(cell const& c, pixel at, vec3 const& opaque, float weight, vec3 const& unclamped) const {
    u32 const x = static_cast<u32>(at.x), y = static_cast<u32>(at.y);
    if (x < c.pixels.x0 || x >= c.pixels.x1 || y < c.pixels.y0 || y >= c.pixels.y1) return;
    c.first[pixel_offset(c.pixels, x, y)] = Entry::of(opaque, weight, unclamped);
  }
};

}  // namespace gart
