#pragma once
/// \file
/// Where the slot of (primitive, tile, pixel) lies in the hit buffer: primitive-major, then tile, then pixel,
///   idx(i, t, p) = O_primitive(i) + O_tile(i, t) + O_pixel(i, t, p).
/// O_primitive is a prefix sum of box areas in 64 bits. The rest is a closed form of the box. The grid's lines cut it
/// into tiles, row by row. Each holds its pixels row by row. A bijection onto [0, sum of areas).

#include <gart/tiles/footprint_slots.hpp>

#include <cstring>

namespace gart { inline namespace GART_ISA {

/// Slots of the box before `cell`, its part in a tile. They are whole rows of cells above, and cells to the left.
GART_HD constexpr u32 tile_offset(footprint_slots const& range, pixel_box const& cell) {
  pixel_box const& box = range.box;
  return (u32{cell.y0} - box.y0) * box.width() + (cell.x0 + range.columns_past(cell.x1) - box.x0) * cell.height();
}

/// Slots of the cell before pixel (x, y): whole rows above, pixels to the left.
GART_HD constexpr u32 pixel_offset(pixel_box const& cell, u32 x, u32 y) {
  return (y - cell.y0) * cell.width() + (x - cell.x0);
}

/// The cell of a primitive and a tile, one 16-byte word, by which many pixels find their slots. Slots are counted in 32
/// bits.
struct alignas(16) tile_slots {
  u32 first = 0;                            ///< slot of the cell's first pixel
  u32 width = 0;                            ///< of the cell, in pixels
  u16 x = 0, y = 0, x1 = 0, y1 = 0;         ///< the cell: [x, x1) x [y, y1)
  static constexpr u32 none = 0xffffffffu;  ///< no slot

  tile_slots() = default;
  /// The cell of a primitive's box and the tile whose pixels are `tile`.
  GART_HD GART_INLINE tile_slots(footprint_slots const& range, pixel_box const& tile) {
    pixel_box const cell = cell_in(range, tile);
    first = static_cast<u32>(range.offset) + tile_offset(range, cell);
    width = cell.width();
    x = cell.x0, y = cell.y0, x1 = cell.x1, y1 = cell.y1;
  }
  /// From memory as one word, where fields would be read one after another.
  GART_HD GART_INLINE static tile_slots read(tile_slots const& from) {
    quad const word = reinterpret_cast<quad const&>(from);
    tile_slots out;
    std::memcpy(static_cast<void*>(&out), &word, sizeof out);
    return out;
  }
  /// Boxes hold every hit; memory stays safe regardless. Without a branch: lanes have not to wait for one another.
  GART_HD GART_INLINE u32 place_of(int px, int py) const {
    u32 const column = static_cast<u32>(px) - x, row = static_cast<u32>(py) - y;
    bool const inside = (column < width) & (row < static_cast<u32>(y1 - y));
    return inside ? first + row * width + column : none;
  }
};

/// The cell of the box that holds pixel (x, y) of the image, which must lie in the box.
template <int Size>
GART_HD constexpr pixel_box cell_of(footprint_slots const& range, u32 x, u32 y) {
  u32 const tx = x / Size * Size, ty = y / Size * Size, seam = static_cast<u32>(range.seam);
  // A tile of the image's last columns ends at the seam, or where the box ends before it.
  u32 const last = x < range.box.x0 ? tx + Size : seam > 0 ? seam : u32{range.box.x1};
  u32 const x1 = last < tx + Size ? last : tx + Size;
  return cell_in(range, {static_cast<u16>(tx), static_cast<u16>(ty), static_cast<u16>(x1),
                         static_cast<u16>(ty + Size < range.box.y1 ? ty + Size : range.box.y1)});
}

/// The slot of pixel (x, y), which must lie in the box.
template <int Size>
GART_HD constexpr u64 hit_slot_index(footprint_slots const& range, u32 x, u32 y) {
  pixel_box const cell = cell_of<Size>(range, x, y);
  return range.offset + tile_offset(range, cell) + pixel_offset(cell, x, y);
}

}}  // namespace gart::GART_ISA
