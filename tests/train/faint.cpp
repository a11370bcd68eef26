// Gaussians fainter than alpha_min get no gradient: a trainer has its densification count them as dead. So are those
// that a filter makes as faint.
#include "runs.hpp"

#include <algorithm>
#include <cmath>

using namespace gart_test;

namespace {

constexpr float faint = 0.03f;  // more than the 0.005 that counts as dead by itself, less than 0.05 hides
constexpr float small = -8.5f;  // exp of it is 0.0002, of a filter 0.04 wide at the cloud, and 0.005 before a camera

// One step that densifies, from a cloud; nothing grows.
template <class E>
gart::gaussian_model densified(E& exec, gart::densify_kind densify, gart::gaussian_model const& start,
                               gart::render_options const& render) {
  auto const data = capture(exec, gart_test::seed());
  gart::train_options options;
  options.iterations = 60;
  options.max_gaussians = static_cast<gart::index_t>(start.size());
  options.densify = densify;
  options.error.from = options.mcmc.from = options.adc.from = 0;
  options.error.every = options.mcmc.every = options.adc.every = 1;
  options.adc.gradient = 1e6f;
  options.render = render;
  run_of<E> run(exec, options, data, start);
  run.step();
  return run.model();
}

// Every third is faint.
template <class E>
gart::gaussian_model densified(E& exec, gart::densify_kind densify, float alpha_min) {
  gart::gaussian_model start = cloud(gart_test::seed() + 1, 0.7f);
  for (std::size_t i = 0; i < start.size(); ++i) start.opacity[i] = i % 3 == 0 ? std::log(faint / (1 - faint)) : 1.0f;
  gart::render_options render;
  render.alpha_min = alpha_min;
  return densified(exec, densify, start, render);
}

// Every third is far smaller than the filter, and opaque.
template <class E>
gart::gaussian_model filtered(E& exec, gart::densify_kind densify, float antialias) {
  gart::gaussian_model start = cloud(gart_test::seed() + 1, 0.7f);
  for (std::size_t i = 0; i < start.size(); ++i) start.opacity[i] = 1.0f;
  for (std::size_t i = 0; i < start.log_scale.size(); i += 9)
    for (std::size_t k = 0; k < 3; ++k) start.log_scale[i + k] = small;
  gart::render_options render;
  render.antialias = antialias;
  return densified(exec, densify, start, render);
}

std::size_t small_ones(gart::gaussian_model const& m) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < m.size(); ++i) count += std::abs(m.log_scale[3 * i] - small) < 0.5f ? 1 : 0;
  return count;
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

TEST_CASE_TEMPLATE("filtered Gaussians relocate, give up rows or are removed", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  E exec;
  for (auto const densify : {gart::densify_kind::mcmc, gart::densify_kind::error, gart::densify_kind::adc}) {
    CAPTURE(static_cast<int>(densify));
    CHECK(small_ones(filtered(exec, densify, 0)) == 50);
    auto const left = filtered(exec, densify, 0.3f);
    CHECK(left.size() == (densify == gart::densify_kind::adc ? 100 : 150));
    CHECK(small_ones(left) == 0);
  }
}

TEST_CASE_TEMPLATE("of all views' filters the narrowest counts", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::uniform_real_distribution<double> uniform(-0.4, 0.4);
  E exec;
  auto const data = capture(exec, gart_test::seed());
  gart::gaussian_model model = cloud(gart_test::seed(), 0.5f);
  for (float& x : model.mean) x = static_cast<float>(uniform(random));  // all of them are in all images
  gart::gaussians<E> const scene(exec, model);
  gart::min_pixel_filter<E> least(exec);
  auto const view = [&](std::size_t k) {
    gart::camera c = data.train[k].view;
    c.fx *= k == 2 ? 1.7f : 1.0f;
    return c;
  };
  auto const widths = least.of(exec, scene.view(), data.train.size(), view, 0.3f);
  std::vector<float> host(widths.size());
  exec.copy_out(host.data(), widths.data(), widths.size() * sizeof(float));
  REQUIRE(host.size() == model.size());
  for (std::size_t i = 0; i < model.size(); ++i) {
    double expected = INFINITY;
    for (std::size_t k = 0; k < data.train.size(); ++k) {
      gart::camera const c = view(k);
      double at[3], distance2 = 0;
      for (int a = 0; a < 3; ++a) {
        at[a] = 0;
        for (int b = 0; b < 3; ++b) at[a] += c.rotation[a][b] * (model.mean[3 * i + b] - c.position[b]);
        distance2 += at[a] * at[a];
      }
      double const secant2 = distance2 / (at[2] * at[2]);  // 1 + x^2 + y^2 of the slopes
      expected = std::min(expected, 0.3 * std::sqrt(std::pow(secant2, -1.5) / (double{c.fx} * c.fy) * distance2));
    }
    CHECK(host[i] == doctest::Approx(expected).epsilon(1e-4));
  }
}
