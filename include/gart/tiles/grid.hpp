#pragma once
/// \file
/// The image cut into square tiles, row by row. The tile's side is a compile-time parameter.

#include <gart/math/footprint.hpp>

namespace gart { inline namespace GART_ISA {

/// The tiles of an image.
template <int Size>
struct tile_grid {
  static constexpr int size = Size;           ///< pixels a side
  static constexpr int pixels = Size * Size;  ///< of a whole tile
  int width = 0, height = 0;                  ///< of the image, pixels

  ///@{
  /// Tiles.
  GART_HD u32 columns() const { return static_cast<u32>((width + Size - 1) / Size); }
  GART_HD u32 rows() const { return static_cast<u32>((height + Size - 1) / Size); }
  ///@}
  /// Tiles in all.
  GART_HD u32 count() const { return columns() * rows(); }

  /// The pixels of a tile, cut off at the image's edge.
  GART_HD pixel_box tile(u32 index) const { return tile(index % columns(), index / columns()); }
  /// By column and row.
  GART_HD pixel_box tile(u32 column, u32 row) const {
    u32 const x = column * Size, y = row * Size;
    u32 const w = static_cast<u32>(width), h = static_cast<u32>(height);
    return {static_cast<u16>(x), static_cast<u16>(y), static_cast<u16>(x + Size < w ? x + Size : w),
            static_cast<u16>(y + Size < h ? y + Size : h)};
  }
};

/// The tiles a box of pixels overlaps, in tile coordinates.
template <int Size>
GART_HD constexpr pixel_box tiles_of(pixel_box const& b) {
  if (b.empty()) return {};
  return {static_cast<u16>(b.x0 / Size), static_cast<u16>(b.y0 / Size), static_cast<u16>((b.x1 - 1) / Size + 1),
          static_cast<u16>((b.y1 - 1) / Size + 1)};
}

/// The intersection.
GART_HD constexpr pixel_box intersect(pixel_box const& a, pixel_box const& b) {
  return {a.x0 > b.x0 ? a.x0 : b.x0, a.y0 > b.y0 ? a.y0 : b.y0, a.x1 < b.x1 ? a.x1 : b.x1, a.y1 < b.y1 ? a.y1 : b.y1};
}

}}  // namespace gart::GART_ISA
