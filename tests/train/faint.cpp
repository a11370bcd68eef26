// Gaussians fainter than alpha_min get no gradient: a trainer has its densification count them as dead.
#include "runs.hpp"

#include <algorithm>
#include <cmath>

using namespace gart_test;

namespace {

constexpr float faint = 0.03f;  // more than the 0.005 that counts as dead by itself, less than 0.05 hides

// One step that densifies, from a cloud in which every third Gaussian is faint; nothing grows.
template <class E>
gart::gaussian_model densified(E& exec, gart::densify_kind densify, float alpha_min) {
  auto const seed = gart_test::seed();
  auto const data = capture(exec, seed);
  gart::gaussian_model start = cloud(seed + 1, 0.7f);
  for (std::size_t i = 0; i < start.size(); ++i) start.opacity[i] = i % 3 == 0 ? std::log(faint / (1 - faint)) : 1.0f;
  gart::train_options options;
  options.iterations = 60;
  options.max_gaussians = static_cast<gart::index_t>(start.size());
  options.densify = densify;
  options.error.from = options.mcmc.from = options.adc.from = 0;
  options.error.every = options.mcmc.every = options.adc.every = 1;
  options.adc.gradient = 1e30f;
  options.render.alpha_min = alpha_min;
  run_of<E> run(exec, options, data, start);
  run.step();
  return run.model();
}

// Of how many the opacity is that of the faint, give or take a step of Adam.
std::size_t faint_ones(gart::gaussian_model const& m) {
  return static_cast<std::size_t>(std::count_if(
      m.opacity.begin(), m.opacity.end(), [](float x) { return std::abs(1 / (1 + std::exp(-x)) - faint) < 0.005f; }));
}

}  // namespace

TEST_CASE_TEMPLATE("what alpha_min hides is relocated by MCMC", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  E exec;
  auto const kept = densified(exec, gart::densify_kind::mcmc, 1.0f / 255);
  CHECK(kept.size() == 150);
  CHECK(faint_ones(kept) == 50);
  auto const moved = densified(exec, gart::densify_kind::mcmc, 0.05f);
  CHECK(moved.size() == 150);
  CHECK(faint_ones(moved) == 0);
}

TEST_CASE_TEMPLATE("what alpha_min hides gives its row to a half", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  E exec;
  auto const kept = densified(exec, gart::densify_kind::error, 1.0f / 255);
  CHECK(kept.size() == 150);
  CHECK(faint_ones(kept) == 50);
  auto const moved = densified(exec, gart::densify_kind::error, 0.05f);
  CHECK(moved.size() == 150);
  CHECK(faint_ones(moved) == 0);
}

TEST_CASE_TEMPLATE("what alpha_min hides is removed by ADC", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  E exec;
  auto const kept = densified(exec, gart::densify_kind::adc, 1.0f / 255);
  CHECK(kept.size() == 150);
  CHECK(faint_ones(kept) == 50);
  auto const left = densified(exec, gart::densify_kind::adc, 0.05f);
  CHECK(left.size() == 100);
  CHECK(faint_ones(left) == 0);
}
