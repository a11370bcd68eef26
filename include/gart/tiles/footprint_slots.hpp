#pragma once
/// \file
/// A Gaussian's footprint in a view: its box of pixels, and how many pixels the boxes before have. There its own slots
/// begin in a buffer with one for each pixel (backward/hit_layout.hpp).

#include <gart/tiles/grid.hpp>

namespace gart { inline namespace GART_ISA {

/// One 16-byte word.
struct alignas(16) footprint_slots {
  u64 offset : 48 = 0;  ///< slots before its own
  u64 seam : 16 = 0;    ///< footprint::seam
  pixel_box box;        ///< its pixels

  static constexpr u64 most = (u64{1} << 48) - 1;  ///< of slots

  footprint_slots() = default;
  /// Of a box that crosses no seam, or goes on past that column.
  GART_HD constexpr footprint_slots(u64 before, pixel_box const& pixels, u16 past = 0)
      : offset(before & most), seam(past), box(pixels) {}

  /// The columns by which the box counts as farther right than pixels from `x1` on to its left.
  GART_HD GART_INLINE constexpr u32 columns_past(u32 x1) const { return x1 <= box.x0 ? static_cast<u32>(seam) : 0u; }
};

/// The part of the box in a tile of those pixels, in pixels of the image.
GART_HD constexpr pixel_box cell_in(footprint_slots const& range, pixel_box const& tile) {
  pixel_box const& b = range.box;
  u32 const past = range.columns_past(tile.x1), x0 = tile.x0 + past, x1 = tile.x1 + past;
  return {static_cast<u16>((b.x0 > x0 ? b.x0 : x0) - past), b.y0 > tile.y0 ? b.y0 : tile.y0,
          static_cast<u16>((b.x1 < x1 ? b.x1 : x1) - past), b.y1 < tile.y1 ? b.y1 : tile.y1};
}

/// The tiles that the box overlaps; past the grid's columns those from its first on.
template <int Size>
GART_HD constexpr pixel_box tiles_of(footprint_slots const& range) {
  pixel_box out = tiles_of<Size>(range.box);
  u32 const seam = static_cast<u32>(range.seam);
  if (seam > 0) out.x1 = static_cast<u16>((seam + Size - 1) / Size + (range.box.x1 - seam - 1) / Size + 1);
  return out;
}

}}  // namespace gart::GART_ISA
