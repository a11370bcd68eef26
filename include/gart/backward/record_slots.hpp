#pragma once
/// \file
/// The record of a hit by the methods primitive and hybrid: a slot (backward/hit_slot.hpp) of the hit buffer.
/// backward/hit_layout.hpp has its place. The 3DGART paper calls the buffer LT.

#include <gart/backward/hit_layout.hpp>
#include <gart/backward/hit_slot.hpp>
#include <gart/backward/packet_slots.hpp>
#include <gart/render/record.hpp>

namespace gart { inline namespace GART_ISA {

/// The record of a hit buffer with slots of Entry, of tiles of Size pixels a side.
template <class Entry, int Size>
struct record_slots {
  using entry = Entry;      ///< a slot
  using cell = tile_slots;  ///< finds a pair's slots
  /// [N]: boxes, and where their slots begin.
  footprint_slots const* ranges = nullptr;
  Entry* slots = nullptr;  ///< the hit buffer

  static constexpr bool any = true;     ///< something is left
  static constexpr bool depth = false;  ///< of depth nothing
  /// The number of the hit's slot. Boxes hold every hit; memory stays safe regardless.
  GART_HD GART_INLINE u32 place_of(u32 id, pixel at) const {
    footprint_slots const range = ranges[id];
    pixel_box const& b = range.box;
    u32 const x = static_cast<u32>(at.x), y = static_cast<u32>(at.y), column = x + range.columns_past(x + 1);
    if (column < b.x0 || column >= b.x1 || y < b.y0 || y >= b.y1) return tile_slots::none;
    return static_cast<u32>(hit_slot_index<Size>(range, x, y));
  }
  /// Writes the slot of a hit: the opaque colour V, the weight and the clamps.
  GART_HD GART_INLINE void operator()(u32 place, vec3 const& opaque, float weight, vec3 const& unclamped) const {
    if (place != tile_slots::none) slots[place] = Entry::of(opaque, weight, unclamped);
  }

#if !defined(__CUDACC__)
  using packet_cell = slot_cell;  ///< with the place of its slots
  /// The numbers of the slots of a packet's pixels, which are asked for.
  GART_INLINE lane_words expect(slot_cell const& from, packet_block const& block) const {
    packet_slots const at(from, block.x % Size, block.y % Size);
    at.fetch_to_write(slots);
    return select(at.inside, at.places(), every_lane(tile_slots::none));
  }
  /// Writes the slots of the hits.
  GART_INLINE void operator()(lane_words places, lane_mask hits, vec3_of<lanes> const& opaque, lanes weight,
                              vec3_of<lanes> const& unclamped) const {
    write_slots(slots, places, hits & ~equal(places, every_lane(tile_slots::none)), opaque, weight, unclamped);
  }
#endif
};
static_assert(hit_record<record_slots<hit_entry, 8>>);

}}  // namespace gart::GART_ISA
