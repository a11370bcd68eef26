#pragma once
/// \file
/// The part of a Gaussian's box that lies in a tile (a cell), for the packets of the tile. It says which of their
/// pixels are in the box. It is worked out once a (tile, Gaussian) pair for all packets of the tile. A packet program
/// derives its own data of the pair from it.

#include <gart/tiles/footprint_slots.hpp>
#include <gart/trace/packet_block.hpp>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// A Gaussian's box in a tile.
struct packet_cell {
  static constexpr int largest_tile = 16;  ///< its side
  u64 rows;                                ///< of the tile's rows, bit 4 r: whether row r is in the box
  u32 columns;                             ///< of its columns, a bit each
  u32 id;                                  ///< the Gaussian

  packet_cell() = default;
  /// Of the box of `gaussian` in the tile whose pixels are `tile`.
  GART_INLINE packet_cell(u32 gaussian, footprint_slots const& range, pixel_box const& tile) : id(gaussian) {
    pixel_box const cell = cell_in(range, tile);
    u32 const x = u32{cell.x0} - tile.x0, y = u32{cell.y0} - tile.y0;
    columns = ((u32{1} << cell.width()) - 1) << x;
    rows = (~u64{0} >> (64 - 4 * cell.height()) << 4 * y) & 0x1111111111111111u;
  }

  /// The pixels of the packet at (x, y) in the tile that are in the box, a bit a lane.
  GART_INLINE u32 bits_inside(int x, int y) const {
    constexpr u32 one_a_row = lane_count == 16 ? 0x1111u : lane_count == 8 ? 0x11u : 1u;
    return (columns >> x & 15u) * (static_cast<u32>(rows >> 4 * y) & one_a_row);
  }
  /// The same as a mask.
  GART_INLINE lane_mask inside(int x, int y) const { return lanes_of(bits_inside(x, y)); }
};

}}  // namespace gart::GART_ISA

#endif
