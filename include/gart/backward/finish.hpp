#pragma once
/// \file
/// The last step of the backward pass turns the moments of each Gaussian into gradients (math/hit_gradient.hpp). They
/// are by its mean, log-scale, quaternion and opacity. Where pixels have a filter, it goes back through that.

#include <gart/camera/models.hpp>
#include <gart/core/span.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/math/widened.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/scene/parameters.hpp>

namespace gart { inline namespace GART_ISA {

namespace backward_kernels {

/// Filter: no_filter, or the camera model's that the Gaussians were made through; `scene` is the stored one.
struct no_filter {};

template <class Filter>
struct finish {
  gaussians_view<float const> scene;
  span<ray_gaussian const> gaussians;
  span<float const> moments;
  gaussians_view<float> gradients;
  Filter filter;
  GART_KERNEL void operator()(index_t i) const {
    geometry_gradient out{vec3(0.0f), vec3(0.0f), {0, 0, 0, 0}, 0};
    float m[moment_stride];
    bool seen = false;
    GART_UNROLL
    for (int q = 0; q < moment_stride / 4; ++q) {
      quad const four = reinterpret_cast<quad const*>(moments.data() + std::size_t{moment_stride} * i)[q];
      GART_UNROLL
      for (int k = 0; k < 4; ++k) m[4 * q + k] = four.v[k], seen |= four.v[k] != 0.0f;
    }
    // A view shows a part of a scene: of the others nothing else is read.
    if (seen) {
      ray_gaussian const g = gaussians[i];
      if (g.cutoff >= 0) out = gradient_of(m, load_parameters(scene, i), g);
    }
    for (int k = 0; k < 3; ++k) {
      gradients.mean[std::size_t{3} * i + k] = out.mean[k];
      gradients.log_scale[std::size_t{3} * i + k] = out.log_scale[k];
    }
    float* q = gradients.quaternion + std::size_t{4} * i;
    q[0] = out.rotation.w, q[1] = out.rotation.x, q[2] = out.rotation.y, q[3] = out.rotation.z;
    gradients.opacity[i] = out.opacity;
  }

 private:
  GART_HD GART_INLINE geometry_gradient gradient_of(float const* m, gaussian_parameters const& p,
                                                    ray_gaussian const& g) const {
    if constexpr (std::is_same_v<Filter, no_filter>) {
      return from_moments(m, p, g);
    } else {
      vec3 const mean = filter.from_camera(p);
      filter_at const at = filter.at(mean);
      return pull_back_widened(from_moments(m, widened(p, mean, at.sigma), g), m[0], p, mean, at);
    }
  }
};

}  // namespace backward_kernels

/// `gaussians`: those of `scene` in the view's frame; `moments`: [N][moment_stride], the sums over the view's pixels.
/// antialias: the filter of the pixels that the scene was seen through; 0: none. Overwrites all but gradients.sh.
template <execution E, class View>
void finish_gradients(E& exec, gaussians_view<float const> scene, span<ray_gaussian const> gaussians, View const& view,
                      float antialias, span<float const> moments, gaussians_view<float> gradients) {
  auto const finish = [&]<class Filter>(Filter const& filter) {
    parallel_for(exec, "backward/finish", scene.count,
                 backward_kernels::finish<Filter>{scene, gaussians, moments, gradients, filter});
  };
  if (antialias > 0)
    visit_camera(view, [&](auto const& model) { finish(model.filter(antialias)); });
  else
    finish(backward_kernels::no_filter{});
}

}}  // namespace gart::GART_ISA
