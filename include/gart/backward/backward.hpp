#pragma once
// From the gradient of the image to the gradients of the parameters, by any strategy (strategies.hpp):
//   prepare()  before the forward pass: footprints, tile map and LT buffer, where the strategy records
//   record()   what the forward pass is given
//   run()      gathers and scatters what the strategy says, then turns the moments of each Gaussian into the gradients of
//              its mean, log-scale, quaternion and opacity. Overwrites `gradients`.
//
// Memory beside the gradients: 48 bytes a Gaussian for the moments; where the strategy records, 36 bytes a Gaussian, 8 a
// (primitive, tile) pair and the LT buffer: 4 or 16 bytes for each pixel of each box.

#include <gart/backward/gather.hpp>
#include <gart/backward/scatter.hpp>
#include <gart/backward/strategies.hpp>
#include <gart/render/forward.hpp>
#include <gart/tiles/screen_tiles.hpp>

namespace gart {

namespace backward_kernels {

struct finish {
  gaussians_view<float const> scene;
  span<ray_gaussian const> records;
  span<float const> moments;
  gaussians_view<float> gradients;
  GART_KERNEL void operator()(index_t i) const {
    ray_gaussian const g = records[i];
    geometry_gradient out{vec3(0.0f), vec3(0.0f), {0, 0, 0, 0}, 0};
    if (g.cutoff >= 0) out = from_moments(moments.data() + std::size_t{moment_stride} * i, load_parameters(scene, i), g);
    for (int k = 0; k < 3; ++k) {
      gradients.mean[std::size_t{3} * i + k] = out.mean[k];
      gradients.log_scale[std::size_t{3} * i + k] = out.log_scale[k];
    }
    float* q = gradients.quaternion + std::size_t{4} * i;
    q[0] = out.rotation.w, q[1] = out.rotation.x, q[2] = out.rotation.y, q[3] = out.rotation.z;
    gradients.opacity[i] = out.opacity;
  }
};

}  // namespace backward_kernels

template <execution E, class Strategy, int TileSize = 8>
class backward {
 public:
  using record_type = typename Strategy::template record<TileSize>;
  static constexpr bool records = Strategy::gather::any;
  static constexpr bool ordered = records && Strategy::ordered;

  explicit backward(E& exec) : moments_(exec), own_tiles_(exec), slots_(exec), rows_(exec) {}

  // After the tracer's own preparation: a tracer that has the view's tiles lends them.
  template <class Tracer>
  void prepare(E& exec, Tracer const& tracer, gaussians_view<float const> scene, camera const& view, float alpha_min,
               float near) {
    if constexpr (records) {
      if constexpr (requires { tracer.tiles(); }) {
        tiles_ = &tracer.tiles();
      } else {
        own_tiles_.measure(exec, scene, view, alpha_min, near);
        own_tiles_.map(exec, tile_order::cover);
        tiles_ = &own_tiles_;
      }
      slots_.resize(tiles_->prints().slots());
      stage_scope stage(exec, "clear");
      exec.fill(slots_.data(), 0xff, slots_.size() * sizeof(entry));  // a NaN: not written
    }
  }

  record_type record() const {
    if constexpr (records)
      return {tiles_->prints().ranges().data(), slots_.data()};
    else
      return {};
  }

  // `color` and `color_gradient` are [H][W][3]; `gaussians_in_frame` and the tracer stand as the forward pass used them.
  template <int ShDegree, class Tracer>
  void run(E& exec, Tracer& tracer, gaussians_view<float const> scene, span<ray_gaussian const> gaussians_in_frame,
           camera const& view, render_options const& options, int active_degree, span<float const> color,
           span<float const> color_gradient, gaussians<E>& gradients) {
    stage_scope stage(exec, "backward");
    moments_.resize(std::size_t{moment_stride} * scene.count);
    // The ordered sums write every Gaussian themselves.
    if constexpr (!ordered || Strategy::scatter::any) moments_.zero();
    if constexpr (!ordered) gradients.sh.zero();
    if constexpr (records) {
      tile_grid<TileSize> const& grid = tiles_->grid();
      footprints<E, TileSize> const& prints = tiles_->prints();
      constexpr gather_sums sums = ordered ? gather_sums::ordered : gather_sums::atomic;
      if constexpr (ordered) rows_.resize(prints.pairs() * pair_row<ShDegree>::quads);
      gather_kernel<ShDegree, typename Strategy::gather, entry, TileSize, sums, E> const kernel{
          view,          grid,         tiles_->lists().view(),  prints.ranges().data(), slots_.data(),
          gaussians_in_frame.data(),   scene.sh,     active_degree,           color.data(),
          color_gradient.data(),       gradients.sh.data(), moments_.data(),
          prints.pair_offsets().data(),             rows_.data()};
      parallel_for(exec, "backward/gather", tile_range{grid.count(), 64}, kernel);
      if constexpr (ordered)
        parallel_for(exec, "backward/sum", scene.count * pair_row<ShDegree>::quads,
                     sum_pairs<ShDegree, typename Strategy::gather>{prints.pair_offsets(), prints.pairs(), rows_.data(),
                                                                    gradients.sh.data(), moments_.data()});
    }
    if constexpr (Strategy::scatter::any) {
      pixel_order const order{view.width, view.height};
      scatter_program<ShDegree, typename Strategy::scatter, E> const program{
          view,         order,        scene.sh,     active_degree, options.transmittance_min, gaussians_in_frame.data(),
          color.data(), color_gradient.data(),      gradients.sh.data(),                      moments_.data()};
      tracer.trace(exec, "backward/scatter", order.launch_size(), program);
    }
    parallel_for(exec, "backward/finish", scene.count,
                 backward_kernels::finish{scene, gaussians_in_frame, moments_, gradients.view()});
  }

  std::size_t lt_bytes() const { return records ? slots_.size() * sizeof(entry) : 0; }

 private:
  template <class R>
  struct entry_of {
    using type = float;  // no slots
  };
  template <class R>
    requires requires { typename R::entry; }
  struct entry_of<R> {
    using type = typename R::entry;
  };
  using entry = typename entry_of<record_type>::type;

  buffer<float, E> moments_;
  screen_tiles<E, TileSize> own_tiles_;
  screen_tiles<E, TileSize> const* tiles_ = nullptr;
  buffer<entry, E> slots_;
  buffer<quad, E> rows_;
};

}  // namespace gart
