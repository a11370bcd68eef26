#pragma once
// The tile-primitive map: for every tile, the primitives whose boxes overlap it. One pair for each overlap is emitted
// in primitive order, radix sorted by tile, and a prefix sum over the counts of the tiles says where each tile's list
// begins.
//
// One 32-bit key sorts both by tile and within it, in the bits that the tile's number leaves free:
//   depth   by conservative near depth, cut to those bits (rounded down, so it stays conservative): what the tile-list
//           tracer reads; near_depth() gives the bound a list is sorted by
//   cover   on a device by how much of the tile a box covers, in eight classes, so that lanes that walk the boxes in
//   step
//           have walks of like length; on a host not at all
// Ties stay in primitive order (the sort is stable).

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/tiles/footprints.hpp>

namespace gart {

enum class tile_order { cover, depth };

struct tile_map_view {
  span<u32 const> primitives;  // all lists, tile after tile
  span<u32 const> offsets;     // [tiles + 1]
  int depth_shift = 0;         // bits of a depth that the order leaves out
};

inline int bits_for(u32 count) {
  int bits = 1;
  while (bits < 32 && (u64{1} << bits) < count) ++bits;
  return bits;
}

// A depth (not negative) as an integer of the same order, `shift` low bits dropped; and the depth it stands for.
GART_HD GART_INLINE u32 depth_key(float depth, int shift) { return float_to_bits(depth) >> shift; }
GART_HD GART_INLINE float near_depth(float depth, int shift) { return bits_to_float(depth_key(depth, shift) << shift); }

namespace tile_kernels {

template <execution E, int Size>
struct emit_pairs {
  tile_grid<Size> grid;
  span<lt_range const> ranges;
  span<float const> depths;
  span<u64 const> offsets;
  tile_order order;
  int order_bits, depth_shift;
  span<u32> keys, primitives, counts;
  GART_KERNEL void operator()(index_t i) const {
    pixel_box const box = ranges[i].box, tiles = tiles_of<Size>(box);
    u32 const depth = order == tile_order::depth ? depth_key(depths[i], depth_shift) : 0;
    u64 at = offsets[i];
    for (u32 y = tiles.y0; y < tiles.y1; ++y)
      for (u32 x = tiles.x0; x < tiles.x1; ++x, ++at) {
        u32 const tile = y * grid.columns() + x;
        u32 within = depth;
        if (order == tile_order::cover)
          within = ((intersect(box, grid.tile(x, y)).area() - 1) << order_bits) / tile_grid<Size>::pixels;
        keys[at] = tile << order_bits | within;
        primitives[at] = i;
        E::atomic_add(&counts[tile], 1u);
      }
  }
};

}  // namespace tile_kernels

template <execution E, int Size>
class tile_map {
 public:
  explicit tile_map(E& exec) : keys_(exec), primitives_(exec), counts_(exec), offsets_(exec) {}

  void build(E& exec, tile_grid<Size> const& grid, footprints<E, Size> const& prints, tile_order order) {
    stage_scope stage(exec, "map");
    u64 const pairs = prints.pairs();
    if (pairs >= (u64{1} << 31))
      throw out_of_memory("tile map", pairs * 16, 0,
                          std::to_string(pairs) +
                              " (primitive, tile) pairs, and a map holds 2^31: raise --downscale, lower "
                              "--max-gaussians or take --tracer "
                              "bvh --backward pixel");
    int const tile_bits = bits_for(grid.count());
    int const order_bits = order == tile_order::depth ? 32 - tile_bits : E::device ? 3 : 0;
    depth_shift_ = 31 - order_bits > 0 ? 31 - order_bits : 0;  // 31: a depth's sign bit is never set
    keys_.resize(pairs), primitives_.resize(pairs);
    counts_.resize(grid.count()), offsets_.resize(grid.count() + 1);
    counts_.zero();
    parallel_for(exec, "map/emit", static_cast<index_t>(prints.ranges().size()),
                 tile_kernels::emit_pairs<E, Size>{grid, prints.ranges(), prints.depths(), prints.pair_offsets(), order,
                                                   order_bits, depth_shift_, keys_, primitives_, counts_});
    sort_pairs(exec, keys_.view(), primitives_.view(), tile_bits + order_bits);
    span<u32> const offsets = offsets_.view();
    exclusive_scan(exec, span<u32 const>(counts_), offsets.subspan(0, grid.count()), offsets.subspan(grid.count(), 1));
  }

  tile_map_view view() const { return {primitives_, offsets_, depth_shift_}; }

 private:
  buffer<u32, E> keys_, primitives_, counts_, offsets_;
  int depth_shift_ = 0;
};

}  // namespace gart
