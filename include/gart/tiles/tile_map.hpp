#pragma once
// The tile-primitive map: for every tile, the primitives whose boxes overlap it. One pair for each overlap is emitted
// in primitive order, radix sorted by tile, and a prefix sum over the counts of the tiles says where each tile's list
// begins.
//
// One 32-bit key sorts both by tile and within it, in the bits that the tile's number leaves free, by an order
// (tiles/tile_order.hpp).
// Ties stay in primitive order (the sort is stable).

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/tiles/footprints.hpp>
#include <gart/tiles/tile_order.hpp>

namespace gart {

struct tile_map_view {
  span<u32 const> primitives;  // all lists, tile after tile
  span<u32 const> offsets;     // [tiles + 1]
  span<u32 const> keys;        // of all lists, sorted
  int order_bits = 0;          // low bits of a key: the order's
  int depth_shift = 0;         // of depth_order: bits of a depth that keys leave out

  // In lists sorted by depth_order: no hit of entry k, or of any after it in its list, has a smaller z.
  GART_HD GART_INLINE float depth(u32 k) const {
    return near_depth(keys[k] & ((u32{1} << order_bits) - 1), depth_shift);
  }
};

inline int bits_for(u32 count) {
  int bits = 1;
  while (bits < 32 && (u64{1} << bits) < count) ++bits;
  return bits;
}

namespace tile_kernels {

template <execution E, int Size, class Order>
struct emit_pairs {
  tile_grid<Size> grid;
  span<lt_range const> ranges;
  span<u64 const> offsets;
  Order order;
  int order_bits;
  span<u32> keys, primitives, counts;
  GART_KERNEL void operator()(index_t i) const {
    pixel_box const box = ranges[i].box, tiles = tiles_of<Size>(box);
    if (tiles.empty()) return;
    auto const primitive = order.of(i);
    u64 at = offsets[i];
    for (u32 y = tiles.y0; y < tiles.y1; ++y)
      for (u32 x = tiles.x0; x < tiles.x1; ++x, ++at) {
        u32 const tile = y * grid.columns() + x;
        keys[at] = tile << order_bits | order.key(primitive, intersect(box, grid.tile(x, y)));
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

  template <class Order>
  void build(E& exec, tile_grid<Size> const& grid, footprints<E, Size> const& prints, Order order) {
    stage_scope stage(exec, "map");
    u64 const pairs = prints.pairs();
    if (pairs >= (u64{1} << 31))
      throw out_of_memory("tile map", pairs * 16, 0,
                          std::to_string(pairs) +
                              " (primitive, tile) pairs, and a map holds 2^31: raise --downscale, lower "
                              "--max-gaussians or take --tracer "
                              "bvh --backward pixel");
    int const tile_bits = bits_for(grid.count());
    order_bits_ = order.take(32 - tile_bits);
    depth_shift_ = order.shift();
    keys_.resize(pairs), primitives_.resize(pairs);
    counts_.resize(grid.count()), offsets_.resize(grid.count() + 1);
    counts_.zero();
    parallel_for(exec, "map/emit", static_cast<index_t>(prints.ranges().size()),
                 tile_kernels::emit_pairs<E, Size, Order>{grid, prints.ranges(), prints.pair_offsets(), order,
                                                          order_bits_, keys_, primitives_, counts_});
    sort_pairs(exec, keys_.view(), primitives_.view(), tile_bits + order_bits_);
    span<u32> const offsets = offsets_.view();
    exclusive_scan(exec, span<u32 const>(counts_), offsets.subspan(0, grid.count()), offsets.subspan(grid.count(), 1));
  }

  tile_map_view view() const { return {primitives_, offsets_, keys_, order_bits_, depth_shift_}; }

 private:
  buffer<u32, E> keys_, primitives_, counts_, offsets_;
  int order_bits_ = 0, depth_shift_ = 0;
};

}  // namespace gart
