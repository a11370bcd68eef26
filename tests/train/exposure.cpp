// Exposures as they are learned: their gradients against sums in double, and known gains found again.
#include "runs.hpp"

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

using namespace gart_test;

namespace {

// All views have been visited but one.
table_state some_state(std::mt19937_64& random, std::size_t views, std::size_t fresh) {
  std::size_t const n = views * gart::exposure::floats;
  table_state s{values(random, n), std::vector<float>(n), std::vector<float>(n, 1.0f),
                std::vector<gart::u32>(views, 5)};
  s.visits[fresh] = 0;
  std::fill_n(s.second.begin() + static_cast<std::ptrdiff_t>(fresh * gart::exposure::floats), gart::exposure::floats,
              0.0f);
  return s;
}

gart::train_options learning_exposures(int iterations) {
  gart::train_options options = still(iterations);
  options.exposure = true;
  return options;
}

}  // namespace

TEST_CASE_TEMPLATE("exposed images and gradients match the matrix in double", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  E exec;
  // More pixels than lanes on any policy, fewer, and one.
  for (std::size_t const pixels : {std::size_t{1}, std::size_t{50}, std::size_t{9001}}) {
    CAPTURE(pixels);
    gart::exposure_training<E> training(exec, 3);
    auto const start = some_state(random, 3, 1);
    start.put_into(training);
    auto const image = values(random, 3 * pixels), weights = values(random, 3 * pixels);
    gart::buffer<float, E> const x(exec, image), g(exec, weights);

    auto const shown = on_host(exec, training.expose(1, x));
    training.move(1, on_host(exec, training.differentiate(1, x, g)), 0.01f);
    auto const turned = g.to_host();
    auto const state = state_of(training);

    float const* const m = start.value.data() + gart::exposure::floats;
    double by_matrix[gart::exposure::floats] = {}, size[gart::exposure::floats] = {};
    double worst_image = 0, worst_gradient = 0;
    for (std::size_t p = 0; p < pixels; ++p) {
      for (int c = 0; c < 3; ++c) {
        double y = m[4 * c + 3], t = 0;
        for (int k = 0; k < 3; ++k) {
          double const entry = static_cast<double>(weights[3 * p + c]) * image[3 * p + k];
          y += static_cast<double>(m[4 * c + k]) * image[3 * p + k];
          t += static_cast<double>(m[4 * k + c]) * weights[3 * p + k];
          by_matrix[4 * c + k] += entry, size[4 * c + k] += std::abs(entry);
        }
        by_matrix[4 * c + 3] += weights[3 * p + c], size[4 * c + 3] += std::abs(weights[3 * p + c]);
        worst_image = std::max(worst_image, std::abs(y - shown[3 * p + c]));
        worst_gradient = std::max(worst_gradient, std::abs(t - turned[3 * p + c]));
      }
    }
    CHECK(worst_image < 1e-5);
    CHECK(worst_gradient < 1e-5);
    for (int k = 0; k < gart::exposure::floats; ++k) {
      // Adam's first moment after one step is a tenth of the gradient.
      CHECK(std::abs(10 * state.first[gart::exposure::floats + k] - by_matrix[k]) < 1e-5 * size[k] + 1e-6);
      // And its first step goes against the gradient, by the rate but for the gradient's share of epsilon. Each of the
      // three views gives up a third of it.
      double const step = -0.01 * by_matrix[k] / (std::abs(by_matrix[k]) + 0.03);
      for (std::size_t v = 0; v < 3; ++v) {
        std::size_t const i = v * gart::exposure::floats + static_cast<std::size_t>(k);
        CHECK(std::abs(static_cast<double>(state.value[i]) - start.value[i] - (v == 1 ? 2 : -1) * step / 3) < 1e-5);
      }
    }
    CHECK(state.visits == std::vector<gart::u32>{5, 1, 5});
  }
}

TEST_CASE_TEMPLATE("a non-finite gradient leaves its number of an exposure", E, GART_TEST_POLICIES) {
  E exec;
  gart::exposure_training<E> training(exec, 2);
  gart::buffer<float, E> const x(exec, std::vector<float>{0.5f, 0.25f, 0.75f});
  gart::buffer<float, E> const g(exec, std::vector<float>{std::numeric_limits<float>::quiet_NaN(), 1, 1});
  // The first view to move has all of the mean, and stays.
  gart::exposure const identity;
  training.move(1, std::vector<float>(gart::exposure::floats, 1.0f), 0.1f);
  auto const alone = state_of(training);
  for (int k = 0; k < 2 * gart::exposure::floats; ++k)
    CHECK(std::abs(alone.value[k] - identity.m[k % gart::exposure::floats]) < 1e-6f);
  training.move(0, on_host(exec, training.differentiate(0, x, g)), 0.1f);
  auto const state = state_of(training);
  for (int k = 0; k < 4; ++k) CHECK(state.value[k] == identity.m[k]);
  double const gradient[] = {0.5, 0.25, 0.75, 1};
  for (int k = 4; k < gart::exposure::floats; ++k) {
    double const half = 0.05 * gradient[k % 4] / (gradient[k % 4] + 0.03);
    CHECK(state.value[k] == doctest::Approx(identity.m[k] - half).epsilon(1e-4));
    CHECK(state.value[gart::exposure::floats + k] == doctest::Approx(identity.m[k] + half).epsilon(1e-4));
  }
}

TEST_CASE_TEMPLATE("gains of photographs about their mean are found", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto data = capture(exec, seed);
  float const gains[] = {0.8f, 1.1f, 1.2f, 0.9f};
  for (std::size_t v = 0; v < data.train.size(); ++v)
    for (auto& level : data.train[v].image.data)
      level = static_cast<gart::u8>(std::min(255l, std::lround(gains[v] * level)));
  auto const options = learning_exposures(600);
  run_of<E> run(exec, options, data, cloud(seed, 0.6f));
  float const before = run.step().psnr;
  gart::step_report last;
  while (run.steps_done() < options.iterations) last = run.step();
  CHECK(last.psnr > before + 8);
  CHECK(last.psnr > 30);
  auto const field = run.exposures();
  REQUIRE(field.views().size() == 4);
  for (std::size_t v = 0; v < 4; ++v) {
    // Of a grey that is common in the view: what the matrix does to single colours is not told apart by so few.
    auto const& e = field.views()[v].value;
    CHECK(e.channel(0, 0.3f, 0.3f, 0.3f) == doctest::Approx(0.3f * gains[v]).epsilon(0.12));
    CHECK(field.views()[v].name == data.train[v].name);
  }
  gart::exposure const identity;
  for (int k = 0; k < gart::exposure::floats; ++k) {
    float sum = 0;
    for (auto const& view : field.views()) sum += view.value.m[k];
    CHECK(std::abs(sum / 4 - identity.m[k]) < 1e-4f);
  }
}

TEST_CASE_TEMPLATE("exposures rest at first", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  run_of<E> run(exec, learning_exposures(110), data, cloud(seed + 1, 0.6f));
  auto const visits = [&] {
    auto const of = words(run.state(), "exposure/visits");
    return std::accumulate(of.begin(), of.end(), 0u);
  };
  for (int i = 0; i < 8; ++i) run.step();
  CHECK(visits() == 0);
  run.step();
  CHECK(visits() == 1);
}

TEST_CASE_TEMPLATE("a state carries exposures; other view counts are refused", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto data = capture(exec, seed);
  auto options = learning_exposures(40);
  run_of<E> run(exec, options, data, cloud(seed + 1, 0.6f));
  for (int i = 0; i < 9; ++i) run.step();
  auto const state = run.state();
  CHECK(words(state, "exposure/visits").size() == 4);
  run_of<E> other(exec, options, data, cloud(seed + 1, 0.6f));
  other.set_state(state);
  CHECK(floats(other.state(), "exposure") == floats(state, "exposure"));
  CHECK(floats(other.state(), "exposure/second") == floats(state, "exposure/second"));
  float const next = run.step().loss, again = other.step().loss;
  CHECK(again == doctest::Approx(next).epsilon(1e-5));

  data.train.pop_back();
  run_of<E> fewer(exec, options, data, cloud(seed + 1, 0.6f));
  CHECK_THROWS_WITH_AS(fewer.set_state(state), doctest::Contains("array exposure has"), gart::invalid_argument);

  // A view that is held out is not visited, and has no exposure of its own.
  data = capture(exec, seed);
  options.held_out = {2};
  run_of<E> some(exec, options, data, cloud(seed + 1, 0.6f));
  for (int i = 0; i < 9; ++i) some.step();
  CHECK(some.exposures().views().size() == 3);
  options.exposure = false;
  run_of<E> none(exec, options, data, cloud(seed + 1, 0.6f));
  none.step();
  CHECK(none.exposures().empty());
}
