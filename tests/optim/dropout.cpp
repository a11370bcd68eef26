// Dropout of Gaussians: who is left out, what the others are, and that the scene has its own again.
#include "models.hpp"

#include <support/policies.hpp>

#include <gart/core/error.hpp>
#include <gart/optim/dropout.hpp>
#include <gart/train/option_fields.hpp>

#include <limits>

using namespace gart_test;

namespace {

constexpr int iterations = 100;

template <class E>
std::vector<float> shown_of(gart::dropout<E>& dropout, gart::gaussians<E>& scene, int step,
                            gart::row_owners const& owners = {}) {
  auto const shown = dropout.leave_out(scene, step, iterations, owners);
  return scene.opacity.to_host();
}

bool left_out(float logit) { return sigmoid(logit) < 1e-12; }

}  // namespace

TEST_CASE_TEMPLATE("dropout leaves out a share and makes the rest more opaque", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  constexpr gart::index_t n = 20000;
  gart::gaussian_model model = random_model(n, 0, random);
  for (gart::index_t i = 0; i < n; i += 10) model.opacity[i] *= 4;  // up to what cannot be more opaque
  E exec;
  gart::gaussians<E> scene(exec, model);
  for (float const share : {0.05f, 0.2f, 0.6f}) {
    CAPTURE(share);
    gart::dropout<E> dropout(exec, share, 1, seed);
    auto const shown = shown_of(dropout, scene, 7);
    int out = 0;
    for (gart::index_t i = 0; i < n; ++i) {
      if (left_out(shown[i])) {
        ++out;
        continue;
      }
      double const own = sigmoid(model.opacity[i]), raised = std::min(own / (1 - double{share}), std::max(own, 0.995));
      CAPTURE(i);
      REQUIRE(sigmoid(shown[i]) == doctest::Approx(raised).epsilon(1e-5));
    }
    CHECK(std::abs(out - share * n) < 5 * std::sqrt(n * share * (1 - share)));
    CHECK(scene.opacity.to_host() == model.opacity);  // its own, bit by bit

    // The same step draws the same, another one anew: of both as many as chance has it.
    CHECK(shown_of(dropout, scene, 7) == shown);
    auto const next = shown_of(dropout, scene, 8);
    int both = 0;
    for (gart::index_t i = 0; i < n; ++i) both += left_out(shown[i]) && left_out(next[i]);
    CHECK(std::abs(both - share * share * n) < 5 * std::sqrt(n * share * share));
  }
}

TEST_CASE_TEMPLATE("ranks leave out what one does", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  gart::gaussian_model const model = random_model(1000, 0, random);
  E exec;
  gart::gaussians<E> scene(exec, model);
  gart::dropout<E> one(exec, 0.3f, 1, seed);
  auto const all = shown_of(one, scene, 3);
  for (int rank = 0; rank < 3; ++rank) {
    gart::row_owners const owners{3, rank, 8};
    gart::gaussian_model part;
    part.resize(owners.owned(model.size()), 0);
    for (std::size_t i = 0; i < part.size(); ++i)
      part.opacity[i] = model.opacity[owners.global(static_cast<gart::index_t>(i))];
    gart::gaussians<E> mine(exec, part);
    gart::dropout<E> dropout(exec, 0.3f, 1, seed);
    auto const shown = shown_of(dropout, mine, 3, owners);
    for (std::size_t i = 0; i < part.size(); ++i)
      REQUIRE(shown[i] == all[owners.global(static_cast<gart::index_t>(i))]);
  }
}

TEST_CASE_TEMPLATE("a scope of dropout ends once, a wrong share is refused", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  gart::gaussian_model const model = random_model(100, 0, random);
  E exec;
  gart::gaussians<E> scene(exec, model);
  gart::dropout<E> dropout(exec, 0.5f, 1, 1), nothing(exec, 0, 1, 1);
  {
    auto shown = dropout.leave_out(scene, 0, iterations, {});
    CHECK(scene.opacity.to_host() != model.opacity);
    shown.end();
    CHECK(scene.opacity.to_host() == model.opacity);
  }
  CHECK(scene.opacity.to_host() == model.opacity);
  CHECK(shown_of(nothing, scene, 0) == model.opacity);
  for (float const share : {-0.1f, 1.0f, std::numeric_limits<float>::quiet_NaN()}) {
    gart::train_options wrong;
    wrong.dropout = share;
    CHECK_THROWS_AS(gart::require_options(wrong), gart::invalid_argument);
  }
}

TEST_CASE_TEMPLATE("the last steps of a run show the whole scene", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  gart::gaussian_model const model = random_model(100, 0, random);
  E exec;
  gart::gaussians<E> scene(exec, model);
  auto const steps_without = [&](float until) {
    gart::dropout<E> dropout(exec, 0.5f, until, 1);
    int all = 0;
    for (int step = 0; step < iterations; ++step) {
      bool const whole = shown_of(dropout, scene, step) == model.opacity;
      CHECK((whole || all == 0));  // none is left out again
      all += whole;
    }
    return all;
  };
  CHECK(steps_without(1) == 0);
  CHECK(steps_without(0.75f) == 25);
  CHECK(steps_without(0.95f) == 5);
  CHECK(steps_without(0) == iterations);
  for (float const until : {-0.1f, 1.01f, std::numeric_limits<float>::quiet_NaN()}) {
    gart::train_options wrong;
    wrong.dropout_until = until;
    CHECK_THROWS_AS(gart::require_options(wrong), gart::invalid_argument);
  }
}
