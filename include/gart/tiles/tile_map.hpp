#pragma once
// The tile-primitive map: for every tile, the primitives whose boxes overlap it. One pair for each overlap is emitted in
// primitive order, radix sorted by tile, and a prefix sum over the counts of the tiles says where each tile's list begins.
//
// On a device a list is also ordered by how much of the tile a box covers, in eight classes: lanes that walk in step then
// have walks of like length. Within a class, and on hosts within a tile, primitives ascend (the sort is stable).

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/tiles/footprints.hpp>

namespace gart {

struct tile_map_view {
  span<u32 const> primitives;  // all lists, tile after tile
  span<u32 const> offsets;     // [tiles + 1]
};

namespace tile_kernels {

template <execution E>
inline constexpr int cover_bits = E::device ? 3 : 0;

template <execution E, int Size>
struct emit_pairs {
  tile_grid<Size> grid;
  span<lt_range const> ranges;
  span<u64 const> offsets;
  span<u32> keys, primitives, counts;
  GART_KERNEL void operator()(index_t i) const {
    pixel_box const tiles = tiles_of<Size>(ranges[i].box);
    u64 at = offsets[i];
    for (u32 y = tiles.y0; y < tiles.y1; ++y)
      for (u32 x = tiles.x0; x < tiles.x1; ++x, ++at) {
        u32 const tile = y * grid.columns() + x;
        u32 const cover = intersect(ranges[i].box, grid.tile(tile)).area();
        keys[at] = tile << cover_bits<E> | ((cover - 1) << cover_bits<E>) / tile_grid<Size>::pixels;
        primitives[at] = i;
        E::atomic_add(&counts[tile], 1u);
      }
  }
};

}  // namespace tile_kernels

inline int bits_for(u32 count) {
  int bits = 1;
  while (bits < 32 && (u64{1} << bits) < count) ++bits;
  return bits;
}

template <execution E, int Size>
class tile_map {
 public:
  explicit tile_map(E& exec) : keys_(exec), primitives_(exec), counts_(exec), offsets_(exec) {}

  void build(E& exec, tile_grid<Size> const& grid, footprints<E, Size> const& prints) {
    stage_scope stage(exec, "map");
    u64 const pairs = prints.pairs();
    if (pairs >= (u64{1} << 31))
      throw out_of_memory("tile map", pairs * 16, 0,
                          std::to_string(pairs) + " (primitive, tile) pairs: raise --downscale or lower --max-gaussians");
    keys_.resize(pairs), primitives_.resize(pairs);
    counts_.resize(grid.count()), offsets_.resize(grid.count() + 1);
    counts_.zero();
    parallel_for(exec, "map/emit", static_cast<index_t>(prints.ranges().size()),
                 tile_kernels::emit_pairs<E, Size>{grid, prints.ranges(), prints.pair_offsets(), keys_, primitives_, counts_});
    sort_pairs(exec, keys_.view(), primitives_.view(), bits_for(grid.count()) + tile_kernels::cover_bits<E>);
    span<u32> const offsets = offsets_.view();
    exclusive_scan(exec, span<u32 const>(counts_), offsets.subspan(0, grid.count()), offsets.subspan(grid.count(), 1));
  }

  tile_map_view view() const { return {primitives_, offsets_}; }

 private:
  buffer<u32, E> keys_, primitives_, counts_, offsets_;
};

}  // namespace gart
