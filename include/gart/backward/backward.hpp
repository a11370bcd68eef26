#pragma once
// From the gradient of the image to the gradients of the parameters, by any strategy: gather and scatter what the strategy
// says, then turn the moments of each Gaussian into the gradients of its mean, log-scale, quaternion and opacity.
//
// backward<E>::run overwrites `gradients`, which must have the scene's size and degree.

#include <gart/backward/scatter.hpp>
#include <gart/backward/strategies.hpp>
#include <gart/render/forward.hpp>

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

template <execution E>
class backward {
 public:
  explicit backward(E& exec) : moments_(exec) {}

  // `color` and `color_gradient` are [H][W][3]; `records` and the tracer stand as the forward pass used them.
  template <int ShDegree, class Strategy, class Tracer>
  void run(E& exec, Strategy, Tracer& tracer, gaussians_view<float const> scene, span<ray_gaussian const> records,
           camera const& view, render_options const& options, int active_degree, span<float const> color,
           span<float const> color_gradient, gaussians<E>& gradients) {
    stage_scope stage(exec, "backward");
    moments_.resize(std::size_t{moment_stride} * scene.count);
    moments_.zero();
    gradients.sh.zero();
    if constexpr (Strategy::scatter::any) {
      pixel_order const order{view.width, view.height};
      scatter_program<ShDegree, typename Strategy::scatter, E> const program{
          view,          order,        scene.sh,     active_degree,          options.transmittance_min, records.data(),
          color.data(),  color_gradient.data(), gradients.sh.data(), moments_.data()};
      tracer.trace(exec, "backward/scatter", order.launch_size(), program);
    }
    parallel_for(exec, "backward/finish", scene.count,
                 backward_kernels::finish{scene, records, moments_, gradients.view()});
  }

 private:
  buffer<float, E> moments_;
};

}  // namespace gart
