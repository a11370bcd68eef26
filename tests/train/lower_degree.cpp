// A model of a lower SH degree than the trainer has rows for: the bits of a trainer that is compiled for it.
#include "runs.hpp"

using namespace gart_test;

namespace {

constexpr int steps = 60;

template <class E, int Degree>
using run_in_rows = gart::trainer<E, gart::scene_traits<Degree>, gart::tile_tracer<E>, gart::deterministic_method>;

gart::train_options growing() {
  gart::train_options options;
  options.iterations = steps;
  options.max_gaussians = 400;
  options.sh_every = 10;
  options.error.from = 5, options.error.every = 10;
  return options;
}

bool same_state(gart::training_state const& a, gart::training_state const& b) {
  return same(a.scene, b.scene) && same(a.first, b.first) && same(a.second, b.second) &&
         floats(a, "error_growth/error_sum") == floats(b, "error_growth/error_sum");
}

}  // namespace

TEST_CASE_TEMPLATE("a run of degree 1 in rows of degree 3 has the same bits", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const start = cloud(seed + 1, 0.7f);
  REQUIRE(start.sh_degree == 1);
  run_in_rows<E, 1> own(exec, growing(), data, start);
  run_in_rows<E, 3> in_rows(exec, growing(), data, start);
  CHECK(in_rows.degree() == 1);
  for (int i = 0; i < steps / 2; ++i) own.step(), in_rows.step();
  CHECK(in_rows.size() > start.size());
  CHECK(in_rows.model().sh_degree == 1);
  CHECK(same_state(own.state(), in_rows.state()));

  // A state of either is a state of the other.
  run_in_rows<E, 3> resumed(exec, growing(), data, start);
  resumed.set_state(own.state());
  for (int i = steps / 2; i < steps; ++i) own.step(), resumed.step();
  CHECK(same_state(own.state(), resumed.state()));
  gart::camera const& view = data.train[0].view;
  CHECK(own.render(view, gart::vec3(0.0f)).color.data == resumed.render(view, gart::vec3(0.0f)).color.data);
}

TEST_CASE_TEMPLATE("other degrees and seeds of states, and higher starts, are refused", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const start = cloud(seed + 1, 0.7f);
  run_in_rows<E, 3> run(exec, growing(), data, start);
  gart::training_state other = run.state();
  for (gart::gaussian_model* model : {&other.scene, &other.first, &other.second})
    *model = gart::with_sh_degree(std::move(*model), 3);
  CHECK_THROWS_AS(run.set_state(other), gart::invalid_argument);
  gart::training_state of_another = run.state();
  ++of_another.seed;
  CHECK_THROWS_WITH_AS(run.set_state(of_another), doctest::Contains("the state is of seed"), gart::invalid_argument);
  auto const higher = gart::with_sh_degree(start, 3);
  CHECK_THROWS_AS((run_in_rows<E, 1>(exec, growing(), data, higher)), gart::invalid_argument);
}
