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
