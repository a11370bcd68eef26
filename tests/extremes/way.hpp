#pragma once
// One tracer and one method of ways.hpp, by their types.

#include <extremes/ways.hpp>
#include <support/trace_scene.hpp>

namespace gart_test {

template <class Method, class Tracer, class E>
outcome run_by(E& exec, gart::gaussian_model const& model, gart::camera const& view,
               gart::render_options const& options, std::vector<float> const& color_gradient) {
  gart::gaussians<E> const scene(exec, model);
  gart::gaussians<E> gradients(exec, scene.size(), model.sh_degree);
  frame_by<1, Tracer, E> frame(exec);
  gart::backward_pass<frame_by<1, Tracer, E>, Method> pass(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  gart::buffer<float, E> gradient(exec, color_gradient);
  gart::buffer<gart::u32, E> hits(exec, pixels);
  frame.prepare(scene.view(), view, options);
  if (!pass.prepare(frame)) throw pass.out_of_memory_error();
  pass.render(frame, {color.data(), transmittance.data(), depth.data(), hits.data()});
  gart::differentiate(frame, pass, gradient, gradients);
  return {std::string(Tracer::name) + ", " + Method::name,
          color.to_host(),
          transmittance.to_host(),
          depth.to_host(),
          hits.to_host(),
          gradients.to_host()};
}

}  // namespace gart_test
