#pragma once
// A view's footprints and its tile-primitive map, together: built once a step, used by the tile-list tracer, the LT record
// and the gather.

#include <gart/tiles/tile_map.hpp>

namespace gart {

template <execution E, int Size>
class screen_tiles {
 public:
  static constexpr int tile_size = Size;

  explicit screen_tiles(E& exec) : prints_(exec), map_(exec) {}

  void measure(E& exec, gaussians_view<float const> scene, camera const& view, float alpha_min, float near) {
    grid_ = {view.width, view.height};
    prints_.measure(exec, scene, view, alpha_min, near);
  }
  void map(E& exec, tile_order order) { map_.build(exec, grid_, prints_, order); }

  tile_grid<Size> const& grid() const { return grid_; }
  footprints<E, Size> const& prints() const { return prints_; }
  tile_map<E, Size> const& lists() const { return map_; }

 private:
  tile_grid<Size> grid_;
  footprints<E, Size> prints_;
  tile_map<E, Size> map_;
};

}  // namespace gart
