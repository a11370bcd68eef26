#pragma once
/// \file
/// The footprints of all Gaussians in one view: boxes with their place in the LT buffer, near depths, and how many
/// (primitive, tile) pairs they make. Cost: one launch of double arithmetic over the Gaussians, two prefix sums, and
/// one read of two totals by the host, from which buffers are sized.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/camera/models.hpp>
#include <gart/exec/stage.hpp>
#include <gart/scene/image_rows.hpp>
#include <gart/scene/parameters.hpp>
#include <gart/tiles/footprint_slots.hpp>

namespace gart::inline GART_ISA {

namespace tile_kernels {

// Bounds: of a camera model.
template <class Response, int Size, class Bounds>
struct measure {
  // Through a lens few boxes take far longer than most (camera/lens_bounds.hpp), and a block as long as its last.
  static constexpr int block_size = 64, min_blocks = 1;
  gaussians_view<float const> scene;
  Bounds bounds;
  vec3d frame;
  float alpha_min;
  image_rows rows;
  span<footprint_slots> ranges;
  span<float> depths;
  span<u32> areas, tiles;
  GART_KERNEL void operator()(index_t i) const {
    footprint f = footprint_of<Response>(bounds, load_parameters(scene, i), frame, alpha_min);
    if (f.box.y0 < rows.first) f.box.y0 = static_cast<u16>(rows.first);
    if (f.box.y1 > rows.end) f.box.y1 = static_cast<u16>(rows.end);
    if (f.box.empty()) f.box = {}, f.seam = 0;
    ranges[i].box = f.box, ranges[i].seam = f.seam;
    depths[i] = f.depth;
    areas[i] = f.box.area();
    tiles[i] = tiles_of<Size>(ranges[i]).area();
  }
};

struct place {
  span<u64 const> offsets;
  span<footprint_slots> ranges;
  GART_KERNEL void operator()(index_t i) const { ranges[i].offset = offsets[i] & footprint_slots::most; }
};

}  // namespace tile_kernels

/// The footprints of a view, for tiles of Size pixels a side.
template <execution E, int Size>
class footprints {
 public:
  /// None yet.
  explicit footprints(E& exec)
      : ranges_(exec),
        depths_(exec),
        areas_(exec),
        tiles_(exec),
        area_offsets_(exec),
        pair_offsets_(exec),
        totals_(exec, 2) {}

  /// View: a camera or a camera model. Boxes are cut to `rows`. invalid_argument for a camera that no ray can be cast
  /// by, or a near distance that is not positive.
  template <class Response = generalized_gaussian<>, class View>
  void measure(E& exec, gaussians_view<float const> scene, View const& view, float alpha_min, float near,
               image_rows rows = {}) {
    require_camera(view);
    index_t const n = scene.count;
    ranges_.resize(n), depths_.resize(n), areas_.resize(n), tiles_.resize(n), area_offsets_.resize(n),
        pair_offsets_.resize(n);
    if (n == 0) {
      slots_ = pairs_ = 0;
      return;
    }
    {
      stage_scope stage(exec, "footprint");
      visit_camera(view, [&](auto const& model) {
        auto const bounds = model.bounds(near);
        parallel_for(exec, "footprint/measure", n,
                     tile_kernels::measure<Response, Size, std::remove_const_t<decltype(bounds)>>{
                         scene, bounds, model.position, alpha_min, rows, ranges_, depths_, areas_, tiles_});
      });
    }
    stage_scope stage(exec, "scan");
    exclusive_scan(exec, span<u32 const>(areas_), area_offsets_.view(), totals_.view().subspan(0, 1));
    exclusive_scan(exec, span<u32 const>(tiles_), pair_offsets_.view(), totals_.view().subspan(1, 1));
    parallel_for(exec, "footprint/place", n, tile_kernels::place{area_offsets_, ranges_});
    u64 totals[2];
    exec.copy_out(totals, totals_.data(), sizeof totals);
    slots_ = totals[0], pairs_ = totals[1];
  }

  u64 slots() const { return slots_; }  ///< sum of box areas
  u64 pairs() const { return pairs_; }  ///< (primitive, tile) overlaps
  /// Of each Gaussian, [N].
  span<footprint_slots const> ranges() const { return ranges_; }
  /// Near depths, [N].
  span<float const> depths() const { return depths_; }
  /// Of each Gaussian's first pair, [N].
  span<u64 const> pair_offsets() const { return pair_offsets_; }

 private:
  buffer<footprint_slots, E> ranges_;
  buffer<float, E> depths_;
  buffer<u32, E> areas_, tiles_;
  buffer<u64, E> area_offsets_, pair_offsets_, totals_;
  u64 slots_ = 0, pairs_ = 0;
};

}  // namespace gart::inline GART_ISA
