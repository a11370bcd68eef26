// From boxes to the list of primitives of every tile, by tile size. Lists are in the order that the tracer reads, or in
// none.
#include "support/frame.hpp"

#include <gart/tiles/tile_map.hpp>

namespace {

template <int TileSize, bool ByDepth, gart::execution E>
void tile_map(benchmark::State& state, E& exec) {
  gart_bench::frame<E> frame(exec);
  frame.prepare();
  gart::footprints<E, TileSize> prints(exec);
  prints.measure(exec, frame.scene(), frame.view, frame.options.alpha_min, frame.options.near);
  gart::tile_map<E, TileSize> map(exec);
  gart::tile_grid<TileSize> const grid{frame.view.width, frame.view.height};
  if constexpr (ByDepth) {
    gart::depth_orders<E, TileSize> orders(exec);
    gart::camera_rays<E> rays(exec);
    rays.cast(exec, frame.view);
    gart::visit_camera(frame.view, [&](auto const& model) {
      gart::ray_gaussian const* const gaussians = frame.traced.gaussians().data();
      auto const by_depth = orders.of(exec, model, rays, prints.depths().data(), gaussians);
      auto const test = orders.test_of(model, gaussians);
      gart_bench::measure(state, exec, [&] { map.build(exec, grid, prints, by_depth, test); });
    });
  } else {
    gart_bench::measure(state, exec, [&] { map.build(exec, grid, prints, gart::number_order{}); });
  }
  state.counters["pairs"] = static_cast<double>(prints.pairs());
}

}  // namespace

GART_BENCH("tile_map/4/depth", tile_map<4, true>)
GART_BENCH("tile_map/8/depth", tile_map<8, true>)
GART_BENCH("tile_map/16/depth", tile_map<16, true>)
GART_BENCH("tile_map/8/number", tile_map<8, false>)
