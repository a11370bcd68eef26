#pragma once
// One scene through every tracer and every method: the image of the forward pass and the gradients of the backward
// pass. Methods that change the gather alone, which does not know the tracer, run on tile lists. SH degree 1, the
// least that has a direction. Bodies are in ways.cpp, compiled once (gart_test's BODIES extremes_ways).

#include <extremes/scenes.hpp>
#include <support/policies.hpp>
#include <support/relative_error.hpp>
#include <support/scene_by_kind.hpp>

#include <cmath>
#include <string>
#include <vector>

namespace gart_test {

struct outcome {
  std::string way;  // "tracer, method"
  std::vector<float> color, transmittance, depth;
  std::vector<gart::u32> hits;
  gart::gaussian_model gradients;
};

template <class E>
outcome run_one(E& exec, tracer_kind kind, std::string const& method, gart::gaussian_model const& model,
                gart::camera const& view, gart::render_options const& options,
                std::vector<float> const& color_gradient);

// All of them. The first is tile lists and primitive.
template <class E>
std::vector<outcome> run_all(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                             gart::render_options const& options, std::vector<float> const& color_gradient);

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
