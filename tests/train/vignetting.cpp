// Falloffs of lenses as they are learned: gradients against sums in double, and a known falloff found again.
#include "runs.hpp"

#include <cmath>
#include <limits>
#include <vector>

using namespace gart_test;

namespace {

// Views of two lenses in turn.
std::vector<gart::named_camera> some_views(int width, int height) {
  std::vector<gart::named_camera> views;
  for (int v = 0; v < 4; ++v) {
    gart::camera c;
    c.width = width, c.height = height, c.fx = c.fy = static_cast<float>(v % 2 ? 3 * width : 2 * width);
    c.cx = 0.4f * static_cast<float>(width), c.cy = 0.7f * static_cast<float>(height);
    c.position.x = v;
    views.push_back({std::to_string(v), c});
  }
  return views;
}

double square_in_double(gart::camera const& c, std::size_t pixel) {
  double const x = static_cast<double>(pixel % static_cast<std::size_t>(c.width)) + 0.5 - static_cast<double>(c.cx);
  double const y = static_cast<double>(pixel / static_cast<std::size_t>(c.width)) + 0.5 - static_cast<double>(c.cy);
  return (x * x + y * y) * 4 / (1.0 * c.width * c.width + 1.0 * c.height * c.height);
}

double gain_in_double(float const* k, double u) {
  return 1 + static_cast<double>(k[0]) * u + static_cast<double>(k[1]) * u * u + static_cast<double>(k[2]) * u * u * u;
}

// Its photographs, through a lens.
void darken(gart::dataset& data, float const* k) {
  for (auto& view : data.train) {
    for (std::size_t i = 0; i < view.image.data.size(); ++i) {
      double const v = gain_in_double(k, square_in_double(view.view, i / 3));
      view.image.data[i] = static_cast<gart::u8>(std::lround(v * view.image.data[i]));
    }
  }
}

gart::train_options learning_falloffs(int iterations) {
  gart::train_options options = still(iterations);
  options.vignetting = true;
  return options;
}

}  // namespace

TEST_CASE_TEMPLATE("shaded images and gradients match the polynomial in double", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  // More pixels than lanes on any policy, fewer, and one.
  for (auto const& [width, height] : {std::pair{1, 1}, std::pair{10, 5}, std::pair{151, 119}}) {
    CAPTURE(width);
    auto const views = some_views(width, height);
    gart::vignetting_training<E> training(exec, views);
    REQUIRE(training.lenses().size() == 2);
    table_state const start{values(random, 18), std::vector<float>(18), std::vector<float>(18), {0, 0}};
    start.put_into(training);
    std::size_t const pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
    auto const image = values(random, 3 * pixels), weights = values(random, 3 * pixels);
    gart::buffer<float, E> const x(exec, image), g(exec, weights);

    auto const shown = on_host(exec, training.shade(3, views[3].view, x));  // through the second lens
    training.move_lens_of(3, on_host(exec, training.differentiate(3, views[3].view, x, g)), 0.01f);
    auto const turned = g.to_host();
    auto const state = state_of(training);

    float const* const k = start.value.data() + 9;
    double by_falloff[9] = {}, size[9] = {}, worst_image = 0, worst_gradient = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
      double const u = square_in_double(views[3].view, p);
      for (std::size_t c = 0; c < 3; ++c) {
        std::size_t const i = 3 * p + c;
        double const v = gain_in_double(k + 3 * c, u);
        double power = static_cast<double>(image[i]) * static_cast<double>(weights[i]);
        for (std::size_t j = 3 * c; j < 3 * c + 3; ++j) power *= u, by_falloff[j] += power, size[j] += std::abs(power);
        worst_image = std::max(worst_image, std::abs(v * static_cast<double>(image[i]) - shown[i]));
        worst_gradient = std::max(worst_gradient, std::abs(v * static_cast<double>(weights[i]) - turned[i]));
      }
    }
    CHECK(worst_image < 3e-5);
    CHECK(worst_gradient < 3e-5);
    for (std::size_t j = 0; j < 9; ++j) {
      // Adam's first moment after one step is a tenth of the gradient, and its first step the rate against it.
      CHECK(std::abs(10 * static_cast<double>(state.first[9 + j]) - by_falloff[j]) < 1e-5 * size[j] + 1e-6);
      CHECK(state.value[9 + j] - k[j] == doctest::Approx(by_falloff[j] > 0 ? -0.01 : 0.01).epsilon(1e-3));
      CHECK(state.value[j] == start.value[j]);
    }
    CHECK(state.visits == std::vector<gart::u32>{0, 1});
  }
}

TEST_CASE_TEMPLATE("a gradient that is not finite leaves a falloff as it is", E, GART_TEST_POLICIES) {
  E exec;
  auto const views = some_views(1, 1);
  gart::vignetting_training<E> training(exec, views);
  gart::buffer<float, E> const x(exec, std::vector<float>{0.5f, 0.25f, 0.75f});
  gart::buffer<float, E> const g(exec, std::vector<float>{std::numeric_limits<float>::quiet_NaN(), 1, 1});
  training.move_lens_of(0, on_host(exec, training.differentiate(0, views[0].view, x, g)), 0.1f);
  auto const state = state_of(training);
  for (std::size_t j = 0; j < 3; ++j) {
    CHECK(state.value[j] == 0);
    CHECK(state.value[3 + j] != 0);
  }
}

TEST_CASE_TEMPLATE("a lens's falloff is found, beside exposures too", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  bool exposed = false;
  SUBCASE("alone") {}
  SUBCASE("beside exposures") { exposed = true; }
  float const k[] = {-0.3f, -0.1f, -0.05f};
  auto data = capture(exec, seed);
  darken(data, k);
  if (exposed)
    for (auto& level : data.train[1].image.data) level = static_cast<gart::u8>(std::lround(0.8 * level));
  auto options = learning_falloffs(800);
  options.exposure = exposed;
  options.rates.vignetting = 0.01f, options.rates.vignetting_final = 1e-4f;
  run_of<E> run(exec, options, data, cloud(seed, 0.6f));
  gart::step_report last;
  float least = HUGE_VALF;
  while (run.steps_done() < options.iterations) {
    last = run.step();
    if (run.steps_done() > options.iterations - 4) least = std::min(least, last.psnr);
  }
  CHECK(least > 36);
  auto const field = run.exposures();
  REQUIRE(field.lenses().size() == 1);
  CHECK(field.views().size() == (exposed ? 4 : 0));
  // Where the cloud is: pixels of the corners are dark, and say little of a falloff.
  for (double const u : {0.1, 0.3, 0.5}) {
    CAPTURE(u);
    for (int c = 0; c < 3; ++c)
      CHECK(field.lenses()[0].value.gain(c, static_cast<float>(u)) ==
            doctest::Approx(gain_in_double(k, u)).epsilon(0.05));
  }

  // What the trainer shows is what apply() makes of the scene's own colours.
  auto own = run.render(data.train[1].view, gart::vec3(0.0f)).color;
  apply(field.at(data.train[1].view), own);
  double square = 0;
  for (std::size_t i = 0; i < own.data.size(); ++i) {
    double const d = std::clamp(static_cast<double>(own.data[i]), 0.0, 1.0) - data.train[1].image.data[i] / 255.0;
    square += d * d / static_cast<double>(own.data.size());
  }
  CHECK(-10 * std::log10(square) > 34);
}

TEST_CASE_TEMPLATE("a state carries falloffs; other lens counts are refused", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto data = capture(exec, seed);
  auto options = learning_falloffs(40);
  run_of<E> run(exec, options, data, cloud(seed + 1, 0.6f));
  for (int i = 0; i < 9; ++i) run.step();
  auto const state = run.state();
  CHECK(words(state, "vignetting/visits") == std::vector<gart::u32>{9});
  run_of<E> other(exec, options, data, cloud(seed + 1, 0.6f));
  other.set_state(state);
  CHECK(floats(other.state(), "vignetting") == floats(state, "vignetting"));
  CHECK(floats(other.state(), "vignetting/second") == floats(state, "vignetting/second"));
  float const next = run.step().loss, again = other.step().loss;
  CHECK(again == doctest::Approx(next).epsilon(1e-5));

  data.train[1].view.fx *= 1.05f;  // calibrated anew
  data.train[2].view.fx *= 1.5f;
  run_of<E> more(exec, options, data, cloud(seed + 1, 0.6f));
  CHECK_THROWS_WITH_AS(more.set_state(state), doctest::Contains("array vignetting has"), gart::invalid_argument);
  options.held_out = {2};
  run_of<E> held(exec, options, data, cloud(seed + 1, 0.6f));
  for (int i = 0; i < 9; ++i) held.step();
  CHECK(held.exposures().lenses().size() == 1);  // of a lens that no step went through nothing is known
  options.vignetting = false;
  run_of<E> none(exec, options, data, cloud(seed + 1, 0.6f));
  none.step();
  CHECK(none.exposures().empty());

  auto views = some_views(8, 4);
  views[2].view.kind = gart::camera_kind::equirectangular;
  CHECK_THROWS_WITH_AS(gart::vignetting_training<E>(exec, views), doctest::Contains("view 2 has no principal point"),
                       gart::invalid_argument);
}

TEST_CASE_TEMPLATE("exposures act on what the lens let through", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto options = learning_falloffs(40);
  options.exposure = true;
  run_of<E> run(exec, options, data, cloud(seed + 1, 0.6f));
  auto state = run.state();
  auto falloff = floats(state, "vignetting");
  for (int c = 0; c < 3; ++c) falloff[static_cast<std::size_t>(3 * c)] = -0.5f - 0.1f * c;
  state.parts.set("vignetting", falloff);
  state.step = 4;  // exposures rest at first
  run.set_state(state);
  std::vector<float> shown;
  run.step([&](gart::loss_input<E> const& in) {
    shown.resize(in.image.size());
    in.exec.copy_out(shown.data(), in.image.data(), shown.size() * sizeof(float));
    std::vector<float> const ones(shown.size(), 1.0f);
    in.exec.copy_in(in.gradient.data(), ones.data(), ones.size() * sizeof(float));
    in.exec.copy_in(in.value.data(), ones.data(), 2 * sizeof(float));
  });
  // Where all gradients are 1 the exposure's are sums of the image, and the falloff's of the image before the lens.
  double by_exposure[3] = {}, by_falloff[9] = {};
  for (std::size_t i = 0; i < shown.size(); ++i) {
    std::size_t const c = i % 3;
    double const u = square_in_double(data.train[0].view, i / 3);
    double power = static_cast<double>(shown[i]) / gain_in_double(falloff.data() + 3 * c, u);
    by_exposure[c] += static_cast<double>(shown[i]);
    for (std::size_t j = 3 * c; j < 3 * c + 3; ++j) power *= u, by_falloff[j] += power;
  }
  state = run.state();
  std::size_t view = 0;
  while (words(state, "exposure/visits")[view] == 0) ++view;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t k = 0; k < 3; ++k)
      CHECK(10 * floats(state, "exposure/first")[12 * view + 4 * c + k] ==
            doctest::Approx(by_exposure[k]).epsilon(1e-4));
  for (std::size_t j = 0; j < 9; ++j)
    CHECK(10 * floats(state, "vignetting/first")[j] == doctest::Approx(by_falloff[j]).epsilon(1e-4));
}
