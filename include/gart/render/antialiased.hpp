#pragma once
// A scene as the pixels of one view see it: every Gaussian widened by the filter of its pixels
// (scene/pixel_filter.hpp), once, before anything is made of it, so that every tracer, footprint and box has the same
// bits of it. Without a filter it is the scene itself, and nothing is launched.
// A frame has one (render/frame.hpp); the way back is the backward pass's (backward/finish.hpp).
//
//   antialiased<E> seen(exec);
//   auto const scene = seen.of(exec, stored, view, options.antialias);
//
// Memory: 16 bytes a Gaussian where there is a filter. Errors: invalid_argument for a camera no ray can be cast by.

#include <gart/exec/buffer.hpp>
#include <gart/exec/stage.hpp>
#include <gart/scene/pixel_filter.hpp>

namespace gart::inline GART_ISA {

namespace render_kernels {

struct filter_gaussians {
  gaussians_view<float const> scene;
  pixel_filter filter;
  float *log_scale, *opacity;
  GART_KERNEL void operator()(index_t i) const {
    gaussian_parameters const g = filtered(load_parameters(scene, i), filter);
    for (int k = 0; k < 3; ++k) log_scale[std::size_t{3} * i + k] = g.log_scale[k];
    opacity[i] = g.opacity;
  }
};

}  // namespace render_kernels

template <execution E>
class antialiased {
 public:
  explicit antialiased(E& exec) : log_scale_(exec), opacity_(exec) {}

  // pixels: the filter's standard deviation, 0 for none. Valid until the next call.
  gaussians_view<float const> of(E& exec, gaussians_view<float const> scene, camera const& view, float pixels) {
    if (!(pixels > 0)) return scene;
    log_scale_.resize(std::size_t{3} * scene.count), opacity_.resize(scene.count);
    parallel_for(
        exec, "antialias", scene.count,
        render_kernels::filter_gaussians{scene, pixel_filter(view, pixels), log_scale_.data(), opacity_.data()});
    scene.log_scale = log_scale_.data(), scene.opacity = opacity_.data();
    return scene;
  }

 private:
  buffer<float, E> log_scale_, opacity_;
};

}  // namespace gart::inline GART_ISA
