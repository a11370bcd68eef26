// Training with dropout of Gaussians: a step is one of the scene that it shows, and a run that was stopped goes on with
// the same draws.
#include "runs.hpp"

using namespace gart_test;

namespace {

template <class E>
using run = run_of<E, gart::deterministic_method>;

gart::train_options options_with(float dropout, gart::densify_kind densify = gart::densify_kind::none) {
  gart::train_options options;
  options.iterations = 80, options.max_gaussians = 230, options.densify = densify, options.dropout = dropout;
  options.error.from = 10, options.error.every = 10;
  return options;
}

}  // namespace

TEST_CASE_TEMPLATE("a step's gradients are those of the Gaussians it shows", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const start = cloud(seed + 1, 0.7f);
  run<E> dropping(exec, options_with(0.4f), data, start);

  gart::gaussian_model shown = start;
  {
    gart::gaussians<E> scene(exec, start);
    gart::dropout<E> dropout(exec, 0.4f, 1, options_with(0.4f).seed);
    auto const scope = dropout.leave_out(scene, 0, 1, {});
    shown.opacity = scene.opacity.to_host();
  }
  run<E> plain(exec, options_with(0), data, shown);
  CHECK(dropping.step().loss == plain.step().loss);
  auto const got = dropping.gradients().to_host(), expected = plain.gradients().to_host();
  CHECK(same(got, expected));
  gart::gaussian_model const after = dropping.model();
  int out = 0;
  for (std::size_t i = 0; i < start.size(); ++i) {
    if (shown.opacity[i] > -20) continue;
    ++out;
    CHECK(got.opacity[i] == 0);
    CHECK(after.opacity[i] == start.opacity[i]);
  }
  CHECK(out > 20);
}

TEST_CASE_TEMPLATE("a run with dropout learns, grows and resumes", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const start = cloud(seed + 1, 0.7f);
  auto const options = options_with(0.2f, gart::densify_kind::error);
  run<E> whole(exec, options, data, start), resumed(exec, options, data, start);
  float before = 0, after = 0;
  for (int i = 0; i < options.iterations; ++i) {
    float const loss = whole.step().loss;
    if (i < 8) before += loss;
    if (i >= options.iterations - 8) after += loss;
    if (i == 36) resumed.set_state(whole.state());
  }
  while (resumed.steps_done() < options.iterations) resumed.step();
  CHECK(whole.scene().size() > start.size());
  CHECK(after < 0.8f * before);
  CHECK(same(resumed.model(), whole.model()));
}

TEST_CASE_TEMPLATE("the end of a run with dropout is one of a run without", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const start = cloud(seed + 1, 0.7f);
  auto options = options_with(0.3f);
  options.dropout_until = 0.5f;
  auto without = options;
  without.dropout = 0;
  int const half = options.iterations / 2;
  run<E> dropping(exec, options, data, start), plain(exec, without, data, start);
  while (dropping.steps_done() < half - 1) dropping.step();
  plain.set_state(dropping.state());
  CHECK(dropping.step().loss != plain.step().loss);  // the last that leaves any out
  plain.set_state(dropping.state());
  for (int i = 0; i < 8; ++i) CHECK(dropping.step().loss == plain.step().loss);
  CHECK(same(dropping.model(), plain.model()));
}
