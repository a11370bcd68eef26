// From boxes to the list of primitives of every tile: by tile size, in the order that the tracer reads or the gather.
#include "support/frame.hpp"

#include <gart/tiles/tile_map.hpp>

namespace {

template <int TileSize, gart::tile_order Order, gart::execution E>
void tile_map(benchmark::State& state, E& exec) {
  gart_bench::frame<E> frame(exec);
  gart::footprints<E, TileSize> prints(exec);
  prints.measure(exec, frame.scene(), frame.view, frame.options.alpha_min, frame.options.near);
  gart::tile_map<E, TileSize> map(exec);
  gart::tile_grid<TileSize> const grid{frame.view.width, frame.view.height};
  gart_bench::measure(state, exec, [&] { map.build(exec, grid, prints, Order); });
  state.counters["pairs"] = static_cast<double>(prints.pairs());
}

}  // namespace

GART_BENCH("tile_map/4/depth", tile_map<4, gart::tile_order::depth>)
GART_BENCH("tile_map/8/depth", tile_map<8, gart::tile_order::depth>)
GART_BENCH("tile_map/16/depth", tile_map<16, gart::tile_order::depth>)
GART_BENCH("tile_map/8/cover", tile_map<8, gart::tile_order::cover>)
