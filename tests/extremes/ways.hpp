#pragma once
// One scene through every tracer and every strategy: the image of the forward pass and the gradients of the backward
// pass. Strategies that change the gather alone, which does not know the tracer, run on tile lists. SH degree 1, the
// least that has a direction.

#include <extremes/scenes.hpp>
#include <support/policies.hpp>
#include <support/relative_error.hpp>
#include <support/trace_scene.hpp>

#include <cmath>
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
  gart::gaussians<E> const scene(exec, model);
  gart::gaussians<E> gradients(exec, scene.size(), model.sh_degree);
  frame_by<1, Tracer, E> frame(exec);
  gart::backward_pass<frame_by<1, Tracer, E>, Strategy> pass(exec);
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
  gart::buffer<float, E> gradient(exec, color_gradient);
  gart::buffer<gart::u32, E> hits(exec, pixels);
  frame.prepare(scene.view(), view, options);
  if (!pass.prepare(frame)) throw pass.no_room();
  pass.render(frame, {color.data(), transmittance.data(), depth.data(), hits.data()});
  gart::differentiate(frame, pass, gradient, gradients);
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
  std::vector<outcome> all;
  auto const add = [&]<class Strategy, class Tracer>(Strategy, std::type_identity<Tracer>) {
    all.push_back(run_one<Strategy, Tracer>(exec, model, view, options, color_gradient));
  };
  std::type_identity<gart::tile_tracer<E>> const by_tiles;
  add(gart::primitive_strategy{}, by_tiles);
  gart::strategies::for_each([&]<class Strategy>(Strategy s) {
    if constexpr (!std::same_as<Strategy, gart::primitive_strategy> && (E::device || !Strategy::lane_by_lane))
      add(s, by_tiles);
    if constexpr (!differs_in_gather<Strategy>) {
      add(s, std::type_identity<gart::bvh_tracer<E>>{});
#if defined(GART_WITH_EMBREE)
      if constexpr (!E::device) add(s, std::type_identity<gart::embree_tracer<E>>{});
#endif
    }
  });
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

// The same of the oracle, in that order.
inline std::vector<double> oracle::parameters::*const oracle_groups[] = {
    &oracle::parameters::mean, &oracle::parameters::log_scale, &oracle::parameters::quaternion,
    &oracle::parameters::opacity, &oracle::parameters::sh};

inline std::vector<float> random_gradient(number_source& random, gart::camera const& view) {
  std::vector<float> g(std::size_t{3} * view.width * view.height);
  for (float& x : g) x = static_cast<float>(random.uniform(-1, 1));
  return g;
}

}  // namespace gart_test
