#pragma once
// Gradients of rays and lenses of a small scene, by a tracer.

#include <gart/lens/differentiate_lens.hpp>
#include <support/policies.hpp>
#include <support/trace_scene.hpp>

#include <vector>

namespace gart_test {

// dL/d an image: [H][W][3], and [H][W] or empty.
struct image_weights {
  std::vector<float> color, depth, transmittance;
};

struct ray_results {
  std::vector<float> direction, origin;  // [H][W][3]
  gart::lens_gradient lens;              // zero where not wanted
};

template <int Degree, class Tracer, class E>
ray_results ray_gradients_by(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                             gart::render_options const& options, int active_degree, image_weights const& by,
                             bool of_lens) {
  gart::gaussians<E> const scene(exec, model);
  frame_by<Degree, Tracer, E> frame(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  gart::buffer<float, E> direction(exec, 3 * pixels), origin(exec, 3 * pixels);
  gart::buffer<float, E> const by_color(exec, by.color), by_depth(exec, by.depth),
      by_transmittance(exec, by.transmittance);
  frame.prepare(scene.view(), view, options, active_degree);
  frame.render({.color = color.data(), .transmittance = transmittance.data(), .depth = depth.data()});
  gart::image_gradients const image{by_color, by_depth, by_transmittance};
  gart::depth_image more;
  more.depth = depth.data(), more.transmittance = transmittance.data();
  gart::differentiate_rays(frame, color, image, {direction.data(), origin.data()}, more);
  ray_results out{direction.to_host(), origin.to_host(), {}};
  if (of_lens) out.lens = gart::differentiate_lens(frame, color, image, more);
  return out;
}

}  // namespace gart_test
