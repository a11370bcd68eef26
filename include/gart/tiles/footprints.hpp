#pragma once
/// \file
/// The footprints of all Gaussians in one view: boxes with their place in the hit buffer, and near depths. Also the
/// number of (primitive, tile) pairs they make. Cost: one launch of double arithmetic over the Gaussians, and two
/// prefix sums. A lens needs another launch over those that it shows large. The host reads two totals, which size the
/// buffers.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/camera/models.hpp>
#include <gart/exec/stage.hpp>
#include <gart/scene/image_rows.hpp>
#include <gart/scene/parameters.hpp>
#include <gart/tiles/footprint_slots.hpp>

namespace gart { inline namespace GART_ISA {

namespace tile_kernels {

// Bounds: of a camera model. What takes long is left to measure_left.
template <execution E, class Response, int Size, class Bounds>
struct measure {
  static constexpr int block_size = 64, min_blocks = 1;  // a block takes as long as the slowest of its boxes
  gaussians_view<float const> scene;
  Bounds bounds;
  vec3d frame;
  float alpha_min;
  image_rows rows;
  span<footprint_slots> ranges;
  span<float> depths;
  span<u32> areas, tiles;
  span<u64> left;   // Gaussians, in no order
  u64* left_count;  // of these
  GART_KERNEL void operator()(index_t i) const {
    ellipsoid e;
    footprint f;
    bool wide = false;
    if (ellipsoid_of<Response>(load_parameters(scene, i), frame, alpha_min, e)) {
      if constexpr (detail::staged_bounds<Bounds>)
        f = bounds.narrow(e, wide);
      else
        f = bounds(e);
    }
    if (wide)
      left[E::atomic_add(left_count, u64{1})] = i;
    else
      put(i, f);
  }

 protected:
  GART_KERNEL void put(index_t i, footprint f) const {
    if (f.box.y0 < rows.first) f.box.y0 = static_cast<u16>(rows.first);
    if (f.box.y1 > rows.end) f.box.y1 = static_cast<u16>(rows.end);
    if (f.box.empty()) f.box = {}, f.seam = 0;
    ranges[i] = footprint_slots(0, f.box, f.seam);
    depths[i] = f.depth;
    areas[i] = f.box.area();
    tiles[i] = tiles_of<Size>(ranges[i]).area();
  }
};

template <execution E, class Response, int Size, class Bounds>
struct measure_left : measure<E, Response, Size, Bounds> {
  static constexpr int block_size = 32, min_blocks = 1;
  static constexpr index_t lanes = 32768;  // whatever the count, which the host does not know; a GPU's at once
  GART_KERNEL void operator()(index_t lane) const {
    for (u64 k = lane; k < *this->left_count; k += lanes) {
      index_t const i = static_cast<index_t>(this->left[k]);
      this->put(i, footprint_of<Response>(this->bounds, load_parameters(this->scene, i), this->frame, this->alpha_min));
    }
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

  /// View: a camera or a camera model. Boxes are cut to `rows`. Throws invalid_argument for a camera that no ray can be
  /// cast by, or a near distance that is not positive.
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
        using bounds_type = std::remove_const_t<decltype(bounds)>;
        // The remaining ones lie where the offsets will, and their count where the total will.
        tile_kernels::measure<E, Response, Size, bounds_type> const kernel{
            scene,   bounds, model.position, alpha_min,     rows,          ranges_,
            depths_, areas_, tiles_,         area_offsets_, totals_.data()};
        constexpr bool staged = detail::staged_bounds<bounds_type>;
        if constexpr (staged) exec.zero(totals_.data(), sizeof(u64));
        parallel_for(exec, "footprint/measure", n, kernel);
        if constexpr (staged) {
          using rest = tile_kernels::measure_left<E, Response, Size, bounds_type>;
          parallel_for(exec, "footprint/left", rest::lanes, rest{kernel});
        }
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

}}  // namespace gart::GART_ISA
