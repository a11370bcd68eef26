#pragma once
/// \file
/// The narrowest pixel filter at each Gaussian, over all training views (render_options.antialias):
///   r = min over the views of the standard deviation of the filter at the mean, world units.
/// The view of the narrowest filter shows the most of a small Gaussian. Densification uses it: a Gaussian whose opacity
/// through that filter is too low is dead (opacity_shown in optim/rows.hpp). Views are those of
/// whole photographs, whatever size a step's images have.
///
/// Cost: 4 bytes a Gaussian, and a small launch a view at each densification. Without a filter it costs nothing.

#include <gart/camera/models.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/scene/parameters.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

/// Filter: of a camera model.
template <class Filter>
struct min_pixel_filter_kernel {
  gaussians_view<float const> scene;
  Filter filter;
  bool first;  // of the views
  float* least;
  GART_KERNEL void operator()(index_t i) const {
    float const r = filter.sigma_at(filter.from_camera(load_parameters(scene, i)));
    if (first || r < least[i]) least[i] = r;
  }
};

}  // namespace detail

/// The narrowest filter at each Gaussian. Its memory is kept between calls.
template <execution E>
class min_pixel_filter {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit min_pixel_filter(E& exec) : least_(exec) {}

  /// Makes room for so many Gaussians.
  void reserve(u64 count) { least_.reserve(count); }

  /// camera view(k) for k under `views`; pixels: the filter's standard deviation. [N], valid until the next call.
  template <class View>
  span<float const> of(E& exec, gaussians_view<float const> scene, std::size_t views, View const& view, float pixels) {
    least_.resize(scene.count);
    for (std::size_t k = 0; k < views; ++k)
      visit_camera(view(k), [&](auto const& model) {
        auto const filter = model.filter(pixels);
        parallel_for(exec, "min_pixel_filter", scene.count,
                     detail::min_pixel_filter_kernel<std::remove_const_t<decltype(filter)>>{scene, filter, k == 0,
                                                                                            least_.data()});
      });
    return least_.view();
  }

 private:
  buffer<float, E> least_;
};

}}  // namespace gart::GART_ISA
