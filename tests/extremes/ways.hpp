#pragma once
// One scene through every tracer and every strategy: the image of the forward pass and the gradients of the backward
// pass. hybrid and primitive on each tracer; what the other strategies change is the gather alone, which does not know
// the tracer, so they run on tile lists. SH degree 1, the least that has a direction.

#include <support/policies.hpp>
#include <support/trace_scene.hpp>

#include <string>
#include <vector>

namespace gart_test {

struct outcome {
  std::string way;  // "tracer, strategy"
  std::vector<float> color, transmittance, depth;
  std::vector<gart::u32> hits;
  gart::gaussian_model gradients;
};

template <class Strategy, class Tracer, class E>
outcome run_one(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                gart::render_options const& options, std::vector<float> const& color_gradient) {
  Tracer tracer(exec);
  gart::gaussians<E> scene(exec, model);
  gart::gaussians<E> gradients(exec, scene.size(), model.sh_degree);
  gart::frame_records<E> records(exec);
  gart::backward<E, Strategy> pass(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  gart::buffer<float, E> gradient(exec, color_gradient);
  gart::buffer<gart::u32, E> hits(exec, pixels);
  auto const constant = std::as_const(scene).view();
  gart::antialiased<E> filter(exec);
  auto const seen = filter.of(exec, constant, view, options.antialias);
  records.prepare(exec, seen, view.position, options.alpha_min);
  tracer.prepare(exec, seen, records.view(), view, options.alpha_min, options.near);
  if (!pass.prepare(exec, tracer, seen, view, options.alpha_min, options.near)) throw pass.no_room();
  gart::image_targets targets = pass.targets(color.data());
  targets.transmittance = transmittance.data(), targets.depth = depth.data(), targets.hits = hits.data();
  gart::forward<1>(exec, tracer, constant, view, options, 1, targets, pass.record());
  pass.template run<1>(exec, tracer, constant, records.view(), view, options, 1, color, gradient, gradients);
  return {std::string(Tracer::name) + ", " + Strategy::name,
          color.to_host(),
          transmittance.to_host(),
          depth.to_host(),
          hits.to_host(),
          gradients.to_host()};
}

// The first is tile lists and primitive.
template <class E>
std::vector<outcome> run_all(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                             gart::render_options const& options, std::vector<float> const& color_gradient) {
  using tiles = gart::tile_tracer<E>;
  using bvh = gart::bvh_tracer<E>;
  std::vector<outcome> all;
  auto const add = [&]<class Strategy, class Tracer>(Strategy, std::type_identity<Tracer>) {
    all.push_back(run_one<Strategy, Tracer>(exec, model, view, options, color_gradient));
  };
  std::type_identity<tiles> const by_tiles;
  std::type_identity<bvh> const by_bvh;
  add(gart::primitive_strategy{}, by_tiles), add(gart::cleared_strategy{}, by_tiles);
  add(gart::deterministic_strategy{}, by_tiles);
  if constexpr (E::device) add(gart::lane_strategy{}, by_tiles);
  add(gart::hybrid_strategy{}, by_tiles), add(gart::pixel_strategy{}, by_tiles);
  add(gart::primitive_strategy{}, by_bvh), add(gart::hybrid_strategy{}, by_bvh), add(gart::pixel_strategy{}, by_bvh);
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) {
    std::type_identity<gart::embree_tracer<E>> const by_embree;
    add(gart::primitive_strategy{}, by_embree), add(gart::hybrid_strategy{}, by_embree);
    add(gart::pixel_strategy{}, by_embree);
  }
#endif
  return all;
}

struct parameter_group {
  char const* name;
  std::vector<float> gart::gaussian_model::*got;
  int width;  // floats a Gaussian at SH degree 1
};
inline constexpr parameter_group parameter_groups[] = {{"mean", &gart::gaussian_model::mean, 3},
                                                       {"log_scale", &gart::gaussian_model::log_scale, 3},
                                                       {"quaternion", &gart::gaussian_model::quaternion, 4},
                                                       {"opacity", &gart::gaussian_model::opacity, 1},
                                                       {"sh", &gart::gaussian_model::sh, 12}};

}  // namespace gart_test
