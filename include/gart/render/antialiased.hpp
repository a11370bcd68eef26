#pragma once
/// \file
/// A scene as the pixels of one view see it. The pixels' filter (camera/model.hpp) widens every Gaussian once, before
/// all else. So every tracer, footprint and box sees the same bits. Without a filter this is the scene itself, and
/// nothing is launched. A frame has one (render/frame.hpp); the way back is the backward pass's (backward/finish.hpp).
///
///   antialiased<E> seen(exec);
///   auto const scene = seen.of(exec, stored, view, options.antialias);
///
/// Memory: 16 bytes a Gaussian where there is a filter. Errors: invalid_argument for a camera no ray can be cast by.

#include <gart/camera/models.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/stage.hpp>
#include <gart/scene/parameters.hpp>

namespace gart { inline namespace GART_ISA {

namespace render_kernels {

/// Filter: of a camera model.
template <class Filter>
struct filter_gaussians {
  gaussians_view<float const> scene;
  Filter filter;
  float *log_scale, *opacity;
  GART_KERNEL void operator()(index_t i) const {
    gaussian_parameters const g = filtered(load_parameters(scene, i), filter);
    for (int k = 0; k < 3; ++k) log_scale[std::size_t{3} * i + k] = g.log_scale[k];
    opacity[i] = g.opacity;
  }
};

}  // namespace render_kernels

/// The Gaussians of a view as seen through the filter of its pixels; its memory outlives a call, of().
template <execution E>
class antialiased {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit antialiased(E& exec) : log_scale_(exec), opacity_(exec) {}

  /// pixels: the filter's standard deviation, 0 for none. View: a camera or a camera model. Valid until the next call.
  template <class View>
  gaussians_view<float const> of(E& exec, gaussians_view<float const> scene, View const& view, float pixels) {
    if (!(pixels > 0)) return scene;
    require_camera(view);
    log_scale_.resize(std::size_t{3} * scene.count), opacity_.resize(scene.count);
    visit_camera(view, [&](auto const& model) {
      auto const filter = model.filter(pixels);
      parallel_for(exec, "antialias", scene.count,
                   render_kernels::filter_gaussians<std::remove_const_t<decltype(filter)>>{
                       scene, filter, log_scale_.data(), opacity_.data()});
    });
    scene.log_scale = log_scale_.data(), scene.opacity = opacity_.data();
    return scene;
  }

 private:
  buffer<float, E> log_scale_, opacity_;
};

}}  // namespace gart::GART_ISA
