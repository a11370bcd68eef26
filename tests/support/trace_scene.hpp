#pragma once
// Renders, gradients and hit lists of a small scene through the library's templates, for comparison with the oracle.
// What is chosen at run time is in scene_by_kind.hpp, compiled once for all tests.

#include <support/scene_by_kind.hpp>

#include <gart/backward/backward.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/tile_tracer.hpp>
#if defined(GART_WITH_EMBREE)
#include <gart/trace/embree_tracer.hpp>
#endif

#include <stdexcept>
#include <string>
#include <vector>

namespace gart_test {

// Counts with a null list, then writes into the places found by the count.
struct list_program : gart::ray_program_base {
  using ray_type = gart::primary_ray;
  struct state {
    gart::vec3 direction;
    gart::u32 count = 0;
    gart::u32 at = 0;
    float transmittance = 1;
  };
  gart::pixel_rays rays;
  gart::pixel_order order;
  float transmittance_min;
  gart::u32 max_hits;
  gart::u32* counts;
  gart::u32 const* offsets;
  gart::hit* list;

  GART_HD bool active(gart::index_t i) const { return order.inside(order.at(i)); }
  GART_HD gart::pixel at(gart::index_t i) const { return order.at(i); }
  GART_HD state begin(gart::index_t i) const {
    state s;
    s.direction = gart::pixel_ray(rays, order.at(i)).direction;
    if (list) s.at = offsets[order.address(order.at(i))];
    return s;
  }
  GART_HD gart::primary_ray ray_of(gart::index_t, state const& s) const { return {s.direction}; }
  GART_HD bool on_hit(state& s, gart::hit const& h) const {
    if (list) list[s.at + s.count] = h;
    ++s.count;
    s.transmittance *= 1.0f - h.alpha;
    return s.transmittance >= transmittance_min && s.count != max_hits;
  }
  GART_HD void end(gart::index_t i, state const& s) const { counts[order.address(order.at(i))] = s.count; }
};

namespace detail {

// Calls body(std::type_identity<tracer>).
template <class E, class Response = gart::generalized_gaussian<>, class F>
auto with_tracer(tracer_kind kind, F&& body) {
  if (kind == tracer_kind::bvh) return body(std::type_identity<gart::bvh_tracer<E, Response>>{});
  if (kind == tracer_kind::tiles) return body(std::type_identity<gart::tile_tracer<E, 8, Response>>{});
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) return body(std::type_identity<gart::embree_tracer<E, Response>>{});
#endif
  throw std::runtime_error("no such tracer for this policy");
}

}  // namespace detail

template <int Degree, class Tracer, class E>
using frame_by = gart::frame<E, gart::scene_traits<Degree, typename Tracer::response_type>, Tracer>;

template <int Degree, class Tracer, class E>
traced<E> render_by(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                    gart::render_options const& options, int active_degree) {
  gart::gaussians<E> const scene(exec, model);
  frame_by<Degree, Tracer, E> frame(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  gart::buffer<gart::u32, E> hits(exec, pixels);
  frame.prepare(scene.view(), view, options, active_degree);
  frame.render({color.data(), transmittance.data(), depth.data(), hits.data()});
  return {color.to_host(), transmittance.to_host(), depth.to_host(), hits.to_host()};
}

template <int Degree, class Method, class Tracer, class E>
gart::gaussian_model gradients_by(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                  gart::render_options const& options, int active_degree,
                                  std::vector<float> const& color_gradient, attributed_error* error = nullptr) {
  gart::gaussians<E> const scene(exec, model);
  gart::gaussians<E> gradients(exec, scene.size(), model.sh_degree);
  frame_by<Degree, Tracer, E> frame(exec);
  gart::backward_pass<frame_by<Degree, Tracer, E>, Method> pass(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), gradient(exec, color_gradient);
  frame.prepare(scene.view(), view, options, active_degree);
  if (!pass.prepare(frame)) throw pass.out_of_memory_error();
  pass.render(frame, {color.data()});
  gart::buffer<float, E> pixel_error(exec, error ? error->of_pixels : std::vector<float>{});
  gart::differentiate(frame, pass, gradient, gradients, pixel_error);
  if (error) {
    std::vector<float> moments(pass.moments().size());
    exec.copy_out(moments.data(), pass.moments().data(), moments.size() * sizeof(float));
    for (std::size_t i = 0; i < model.size(); ++i)
      error->of_gaussians.push_back(moments[gart::moment_stride * i + gart::error_place]);
  }
  return gradients.to_host();
}

// The gradients by color_gradient, [H][W][3], and by those of depth and transmittance, [H][W] each.
template <int Degree, class Method, class Tracer, class E>
gart::gaussian_model depth_gradients_by(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                        gart::render_options const& options, int active_degree,
                                        std::vector<float> const& color_gradient,
                                        std::vector<float> const& depth_gradient,
                                        std::vector<float> const& transmittance_gradient) {
  gart::gaussians<E> const scene(exec, model);
  gart::gaussians<E> gradients(exec, scene.size(), model.sh_degree);
  frame_by<Degree, Tracer, E> frame(exec);
  gart::backward_pass<frame_by<Degree, Tracer, E>, gart::with_depth<Method>> pass(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  gart::buffer<float, E> const by_color(exec, color_gradient), by_depth(exec, depth_gradient),
      by_transmittance(exec, transmittance_gradient);
  frame.prepare(scene.view(), view, options, active_degree);
  if (!pass.prepare(frame)) throw pass.out_of_memory_error();
  pass.render(frame, {.color = color.data(), .transmittance = transmittance.data(), .depth = depth.data()});
  gart::differentiate(frame, pass, {by_color, by_depth, by_transmittance}, gradients);
  return gradients.to_host();
}

template <class Tracer, class E>
std::vector<std::vector<gart::hit>> hit_lists_by(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                                 gart::render_options const& options) {
  // A list has no colours: of whichever degree.
  gart::gaussians<E> const scene(exec, gart::with_sh_degree(model, 0));
  frame_by<0, Tracer, E> frame(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<gart::u32, E> counts(exec, pixels), starts(exec);
  gart::buffer<gart::hit, E> list(exec);
  frame.prepare(scene.view(), view, options);
  gart::pixel_order const order{view.width, view.height};
  list_program program{{},      frame.rays(), order, options.transmittance_min, options.max_hits, counts.data(),
                       nullptr, nullptr};
  frame.trace("count", order.launch_size(), program);
  std::vector<gart::u32> const count = counts.to_host();
  std::vector<gart::u32> offset(pixels + 1, 0);
  for (std::size_t i = 0; i < pixels; ++i) offset[i + 1] = offset[i] + count[i];
  starts.assign(offset);
  list.resize(offset.back() + 1);
  program.offsets = starts.data(), program.list = list.data();
  frame.trace("list", order.launch_size(), program);
  std::vector<gart::hit> const flat = list.to_host();
  std::vector<std::vector<gart::hit>> lists(pixels);
  for (std::size_t i = 0; i < pixels; ++i) lists[i].assign(flat.begin() + offset[i], flat.begin() + offset[i + 1]);
  return lists;
}

template <class Response, class E>
std::vector<std::vector<gart::hit>> hit_lists_of(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                                 gart::render_options const& options, tracer_kind kind) {
  return detail::with_tracer<E, Response>(
      kind, [&]<class Tracer>(std::type_identity<Tracer>) { return hit_lists_by<Tracer>(exec, model, view, options); });
}

}  // namespace gart_test
