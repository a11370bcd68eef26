// A capture in other units, its poses and starting points with it, trains along the same curve: every length of a
// training is stated in the scene's extent.
#include "runs.hpp"

#include <cmath>
#include <vector>

using namespace gart_test;

namespace {

constexpr int steps = 60;

template <class E>
std::vector<float> losses(E& exec, gart::dataset data, gart::gaussian_model start, gart::densify_kind densify,
                          double unit) {
  data.extent = static_cast<float>(1.5 * unit);
  for (auto& v : data.train) v.view.position *= unit;
  for (float& x : start.mean) x = static_cast<float>(x * unit);
  for (float& s : start.log_scale) s += static_cast<float>(std::log(unit));
  gart::train_options options;
  options.iterations = steps;
  options.max_gaussians = 250;
  options.densify = densify;
  options.error.from = options.mcmc.from = options.adc.from = 10;
  options.error.every = options.mcmc.every = options.adc.every = 10;
  options.adc.gradient = 2e-3f;
  run_of<E, gart::deterministic_method> run(exec, options, data, start);
  std::vector<float> out;
  for (int i = 0; i < steps; ++i) out.push_back(run.step().loss);
  CHECK(run.scene().size() > 150);
  return out;
}

}  // namespace

TEST_CASE_TEMPLATE("a capture in other units trains along the same curve", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const start = cloud(seed + 1, 0.7f);
  for (auto const densify : {gart::densify_kind::error, gart::densify_kind::mcmc, gart::densify_kind::adc}) {
    int const kind = static_cast<int>(densify);
    CAPTURE(kind);
    auto const expected = losses(exec, data, start, densify, 1);
    for (double const unit : {64.0, 1.0 / 64, 0.01, 1000.0}) {
      CAPTURE(unit);
      auto const got = losses(exec, data, start, densify, unit);
      for (int i = 0; i < steps; ++i) {
        CAPTURE(i);
        CHECK(got[i] == doctest::Approx(expected[i]).epsilon(i <= 10 ? 1e-4 : 2e-2));
      }
    }
  }
}
