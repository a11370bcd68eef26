#pragma once
/// \file
/// The tile-primitive map: for every tile, the primitives that its pixels may hit. A pair is emitted for each tile that
/// a primitive's box overlaps, in primitive order, and radix sorted by tile. Pairs that fail the test
/// (tiles/pair_test.hpp) come last, in no tile. A tile's list begins where its number first stands in a key.
///
/// One 32-bit key sorts by tile, and within a tile by an order (tiles/tile_order.hpp). The order has the bits that the
/// tile's number leaves free. Ties stay in primitive order, since the sort is stable.

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/tiles/footprints.hpp>
#include <gart/tiles/pair_test.hpp>
#include <gart/tiles/tile_order.hpp>

namespace gart { inline namespace GART_ISA {

/// The map as kernels hold it.
struct tile_map_view {
  span<u32 const> primitives;     ///< all lists, tile after tile
  span<u32 const> offsets;        ///< [tiles + 1]
  span<u32 const> keys;           ///< of all lists, sorted
  int order_bits = 0;             ///< low bits of a key: the order's
  int depth_shift = 0;            ///< of depth_order: bits of a depth that keys leave out
  span<u32 const> longest_first;  ///< the tiles, if asked for (rank_tiles)

  /// In lists sorted by depth_order, a bound: hits of entry k and of later ones have at least this z.
  GART_HD GART_INLINE float depth(u32 k) const {
    return near_depth(keys[k] & ((u32{1} << order_bits) - 1), depth_shift);
  }
};

/// Bits that tell so many numbers apart; at least 1.
inline int bits_for(u32 count) {
  int bits = 1;
  while (bits < 32 && (u64{1} << bits) < count) ++bits;
  return bits;
}

namespace tile_kernels {

// A team takes some primitives. Its lanes take the pairs of all of them in turn, since boxes differ in size by orders
// of magnitude. A host's one lane takes them box by box.
template <execution E, int Size, tile_order Order, pair_test Test>
struct emit_pairs {
  static constexpr int block_size = 128, min_blocks = 1;
  static constexpr u32 share = 128;  // primitives of a team
  struct scratch {
    typename Order::primitive primitive[share];
    typename Test::primitive tested[share];
    bool is_tested[share];
    footprint_slots range[share];
    u32 first[share];  // of the team's pairs
  };

  tile_grid<Size> grid;
  span<footprint_slots const> ranges;
  span<u64 const> offsets;
  u64 pairs;
  Order order;
  Test test;
  int order_bits;
  span<u32> keys, primitives;

  GART_KERNEL void operator()(auto const& team) const {
    u32 const begin = team.tile() * share, left = static_cast<u32>(ranges.size()) - begin;
    u32 const n = left < share ? left : share;
    u64 const at = offsets[begin];
    u32 const total = static_cast<u32>((left > share ? offsets[begin + share] : pairs) - at);
    if (total == 0) return;
    scratch& s = team.scratch();
    team.for_each(n, [&](index_t k) {
      s.range[k] = ranges[begin + k];
      s.first[k] = static_cast<u32>(offsets[begin + k] - at);
      if (s.range[k].box.empty()) return;
      s.primitive[k] = order.of(begin + k);
      pixel_box const tiles = tiles_of<Size>(s.range[k]);
      s.is_tested[k] = tiles.width() > 1 && tiles.height() > 1;
      if (s.is_tested[k]) s.tested[k] = test.of(begin + k);
    });
    team.barrier();
    if constexpr (E::device)
      team.for_each(total, [&](index_t pair) { find(s, at, pair, begin, n); });
    else
      for (u32 k = 0; k < n; ++k) {
        pixel_box const tiles = tiles_of<Size>(s.range[k]);
        u64 to = at + s.first[k];
        for (u32 y = tiles.y0; y < tiles.y1; ++y)
          for (u32 x = tiles.x0; x < tiles.x1; ++x) emit(s, k, x, y, to++, begin);
      }
    team.barrier();
  }

 private:
  GART_HD GART_INLINE void find(scratch const& s, u64 at, u32 pair, u32 begin, u32 n) const {
    u32 k = 0;  // the last primitive whose pairs begin no later
    for (u32 step = share / 2; step > 0; step /= 2)
      if (k + step < n && s.first[k + step] <= pair) k += step;
    pixel_box const tiles = tiles_of<Size>(s.range[k]);
    u32 const number = pair - s.first[k];
    emit(s, k, tiles.x0 + number % tiles.width(), tiles.y0 + number / tiles.width(), at + pair, begin);
  }

  GART_HD GART_INLINE void emit(scratch const& s, u32 k, u32 x, u32 y, u64 to, u32 begin) const {
    u32 const column = x < grid.columns() ? x : x - grid.columns(), tile = y * grid.columns() + column;
    pixel_box const cell = cell_in(s.range[k], grid.tile(column, y));
    bool const meets = !s.is_tested[k] || test.meets(s.tested[k], cell, tile);
    keys[to] = meets ? tile << order_bits | order.key(s.primitive[k], cell, tile) : grid.count() << order_bits;
    primitives[to] = begin + k;
  }
};

// Of sorted keys: where a tile's list begins, the first key that is not of a tile before it. Each lane looks for its
// own tile. Most tiles may have no list, as in a strip of an image. Whoever found the next list would fill them all.
struct begin_lists {
  span<u32 const> keys;
  int order_bits;
  span<u32> offsets;  // [tiles + 1]
  GART_KERNEL void operator()(index_t tile) const {
    u32 first = 0, count = static_cast<u32>(keys.size());
    while (count > 0) {
      u32 const half = count / 2;
      bool const before = keys[first + half] >> order_bits < tile;
      first = before ? first + half + 1 : first;
      count = before ? count - half - 1 : half;
    }
    offsets[tile] = first;
  }
};

// Longer lists have smaller keys.
struct rank_tiles {
  static constexpr u32 step = 16, most = 255;
  span<u32 const> offsets;
  span<u32> keys, tiles;
  GART_KERNEL void operator()(index_t i) const {
    u32 const steps = (offsets[i + 1] - offsets[i]) / step;
    keys[i] = most - (steps < most ? steps : most);
    tiles[i] = i;
  }
};

}  // namespace tile_kernels

/// The map of a view, and its buffers.
template <execution E, int Size>
class tile_map {
 public:
  /// No map yet.
  explicit tile_map(E& exec) : keys_(exec), primitives_(exec), offsets_(exec), ranks_(exec), longest_first_(exec) {}

  /// A new map of a view's footprints; out_of_memory for 2^31 pairs or more.
  template <tile_order Order, pair_test Test = every_pair>
  void build(E& exec, tile_grid<Size> const& grid, footprints<E, Size> const& prints, Order order,
             Test const& test = {}) {
    stage_scope stage(exec, "map");
    u64 const pairs = prints.pairs();
    if (pairs >= (u64{1} << 31))
      throw out_of_memory("tile map", pairs * 16, 0,
                          std::to_string(pairs) +
                              " (primitive, tile) pairs, and a map holds 2^31: raise dataset_options.downscale, "
                              "lower train_options.max_gaussians, or take configuration_request.tracer = bvh with "
                              "configuration_request.backward = pixel");
    int const tile_bits = bits_for(grid.count() + 1);  // one more for pairs in no tile
    order_bits_ = order.take(32 - tile_bits);
    depth_shift_ = order.shift();
    keys_.resize(pairs), primitives_.resize(pairs), offsets_.resize(grid.count() + 1);
    using emit = tile_kernels::emit_pairs<E, Size, Order, Test>;
    parallel_for(
        exec, "map/emit",
        tile_range{(static_cast<u32>(prints.ranges().size()) + emit::share - 1) / emit::share, emit::block_size},
        emit{grid, prints.ranges(), prints.pair_offsets(), pairs, order, test, order_bits_, keys_, primitives_});
    sort_pairs(exec, keys_.view(), primitives_.view(), tile_bits + order_bits_);
    parallel_for(exec, "map/begin", static_cast<index_t>(offsets_.size()),
                 tile_kernels::begin_lists{keys_, order_bits_, offsets_});
  }

  /// After build: the tiles by the length of their lists, longest first, in 255 steps of 16. Lists differ by orders of
  /// magnitude, and a long one begun last would keep the whole device waiting.
  void rank_tiles(E& exec) {
    stage_scope stage(exec, "map");
    index_t const tiles = static_cast<index_t>(offsets_.size() - 1);
    ranks_.resize(tiles), longest_first_.resize(tiles);
    parallel_for(exec, "map/rank", tiles, tile_kernels::rank_tiles{offsets_, ranks_, longest_first_});
    sort_pairs(exec, ranks_.view(), longest_first_.view(), 8);
  }

  /// Until the next build.
  tile_map_view view() const { return {primitives_, offsets_, keys_, order_bits_, depth_shift_, longest_first_}; }

 private:
  buffer<u32, E> keys_, primitives_, offsets_, ranks_, longest_first_;
  int order_bits_ = 0, depth_shift_ = 0;
};

}}  // namespace gart::GART_ISA
