#pragma once
/// \file
/// The slots (backward/hit_slot.hpp) of a Gaussian's hits with a packet's rays (trace/packet_walk.hpp). Slots of a row
/// of pixels are consecutive; rows are the width of the cell apart.

#include <gart/backward/hit_layout.hpp>
#include <gart/backward/hit_slot.hpp>
#include <gart/math/lane_transpose.hpp>
#include <gart/trace/packet_cell.hpp>

#include <type_traits>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// The slots of a packet.
struct packet_entries {
  vec3_of<lanes> opaque;  ///< V
  lanes weight;           ///< T alpha of the hits
  lane_mask clamped[3];   ///< channels of the hit's colour
};

/// Writes the slots `places` of the hits of a mask.
template <class Entry>
GART_INLINE void write_slots(Entry* slots, lane_words places, lane_mask hits, vec3_of<lanes> const& opaque,
                             lanes weight, vec3_of<lanes> const& unclamped) {
  if constexpr (std::is_same_v<Entry, hit_entry>) {
    lanes const from[4] = {Entry::signed_by(opaque.x, unclamped.x), Entry::signed_by(opaque.y, unclamped.y),
                           Entry::signed_by(opaque.z, unclamped.z), weight};
    scatter_fours(reinterpret_cast<float*>(slots), places, hits, from);
  } else {
    for (u32 left = bits_of(hits); left; left &= left - 1) {
      int const l = __builtin_ctz(left);
      slots[places[l]] = Entry::of({opaque.x.v[l], opaque.y.v[l], opaque.z.v[l]}, weight.v[l],
                                   {unclamped.x.v[l], unclamped.y.v[l], unclamped.z.v[l]});
    }
  }
}

/// A cell with the place of its slots.
struct slot_cell : packet_cell {
  std::ptrdiff_t first;  ///< number of the slot of the tile's first pixel, had it one: cells may begin behind it
  u32 width;             ///< from a slot to that of the pixel below

  slot_cell() = default;
  /// Of the box of `gaussian` in the tile whose pixels are `tile`.
  GART_INLINE slot_cell(u32 gaussian, footprint_slots const& range, pixel_box const& tile)
      : packet_cell(gaussian, range, tile) {
    pixel_box const cell = cell_in(range, tile);
    u32 const x = u32{cell.x0} - tile.x0, y = u32{cell.y0} - tile.y0;
    width = cell.width();
    first = static_cast<std::ptrdiff_t>(range.offset + tile_offset(range, cell)) -
            static_cast<std::ptrdiff_t>(y * width + x);
  }
};

/// Where a packet's pixels lie among the slots of a cell.
class packet_slots {
 public:
  lane_mask inside;  ///< the pixels that have a slot

  packet_slots() = default;
  /// Of the packet at (x, y) in the tile.
  GART_INLINE packet_slots(slot_cell const& cell, int x, int y)
      : inside(cell.inside(x, y)),
        width_(static_cast<int>(cell.width)),
        first_(cell.first + static_cast<std::ptrdiff_t>(y) * width_ + x) {}

  /// Numbers of the slots, for lanes inside.
  GART_INLINE lane_words places() const {
    return every_lane(static_cast<u32>(first_)) + rows() * static_cast<u32>(width_) + columns();
  }

  /// Asks for the slots' lines, to be written.
  template <class Entry>
  GART_INLINE void fetch_to_write(Entry const* slots) const {
    for (int r = 0; r < packet_block::height; ++r) {
      Entry const* const row = slots + first_ + r * width_;
      prefetch_to_write(row), prefetch_to_write(row + packet_block::width - 1);
    }
  }

  /// Reads the hits' floats of an array of one a slot; zeros where there are no hits.
  GART_INLINE lanes read_depths(float const* depths, lane_mask hits) const {
    lanes out = 0.0f;
    for (u32 left = bits_of(hits); left; left &= left - 1) {
      int const l = __builtin_ctz(left);
      out.v[l] = depths[first_of(l)];
    }
    return out;
  }

  /// Zeros where there are no hits. Geometry: whether V is wanted.
  template <bool Geometry, class Entry>
  GART_INLINE packet_entries read(Entry const* slots, lane_mask hits) const {
    packet_entries out;
    if constexpr (std::is_same_v<Entry, hit_entry>) {
      lanes to[4];
      read_fours(reinterpret_cast<float const*>(slots) + 4 * first_, std::ptrdiff_t{4} * width_, hits, to);
      for (int c = 0; c < 3; ++c) out.opaque[c] = magnitude(to[c]), out.clamped[c] = negative(to[c]);
      out.weight = to[3];
    } else {
      out.opaque = {0.0f, 0.0f, 0.0f}, out.weight = 0.0f;
      u32 clamped[3] = {};
      for (u32 left = bits_of(hits); left; left &= left - 1) {
        int const l = __builtin_ctz(left);
        Entry const entry = slots[first_of(l)];
        out.weight.v[l] = entry.weight();
        for (int c = 0; c < 3; ++c) clamped[c] |= (entry.clamped(c) ? 1u : 0u) << l;
        if constexpr (Geometry) {
          vec3 const v = entry.color();
          for (int c = 0; c < 3; ++c) out.opaque[c].v[l] = v[c];
        }
      }
      for (int c = 0; c < 3; ++c) out.clamped[c] = lanes_of(clamped[c]);
    }
    return out;
  }

  /// Whether the hits' slots were written, for entries that say so.
  template <class Entry>
  GART_INLINE lane_mask written(Entry const* slots) const {
    u32 bits = 0;
    for (u32 left = bits_of(inside); left; left &= left - 1) {
      int const l = __builtin_ctz(left);
      bits |= (slots[first_of(l)].written() ? 1u : 0u) << l;
    }
    return lanes_of(bits);
  }

 private:
  GART_INLINE std::ptrdiff_t first_of(int l) const {
    return first_ + packet_block::row(l) * width_ + packet_block::column(l);
  }
  GART_INLINE static lane_words rows() {
    lane_words r;
    for (int l = 0; l < lane_count; ++l) r[l] = static_cast<u32>(packet_block::row(l));
    return r;
  }
  GART_INLINE static lane_words columns() {
    lane_words r;
    for (int l = 0; l < lane_count; ++l) r[l] = static_cast<u32>(packet_block::column(l));
    return r;
  }

  int width_;
  std::ptrdiff_t first_;  // of the packet's first pixel: before the cell where that pixel lies outside of it
};

}}  // namespace gart::GART_ISA

#endif
