// A method that the library has not: its gradients against the oracle, and a training by it.
#include <models/geometry_method.hpp>
#include <render/expected.hpp>
#include <support/trace_scene.hpp>
#include <train/runs.hpp>

using namespace gart_test;

namespace {

template <class Tracer, class E>
void check_gradients(E& exec, expectation const& e) {
  auto const& s = e.scene;
  std::mt19937_64 engine(seed() + 1);
  auto const w = weighted(s, e.parameters, e.picture, engine);
  auto const got =
      gradients_by<1, geometry_method, Tracer>(exec, s.model, s.view, s.options, s.active_degree, w.color_gradient);
  for (auto const& g : gradient_groups) {
    CAPTURE(g.name);
    CHECK(relative_error(got.*g.got, w.gradients.*g.expected) <= 1e-4);
  }
}

struct course {
  std::vector<float> loss;
  std::string backward;  // of the last step
};

template <class Method, class E>
course train(E& exec, gart::dataset const& data, gart::u64 seed, gart::u64 hit_memory = 0) {
  gart::train_options options;
  options.hit_memory = hit_memory, options.iterations = 40;
  options.densify = gart::densify_kind::none;
  run_of<E, Method> run(exec, options, data, cloud(seed + 1, 0.7f));
  course out;
  while (run.steps_done() < options.iterations) {
    auto const report = run.step();
    out.loss.push_back(report.loss), out.backward = report.backward;
  }
  return out;
}

}  // namespace

TEST_CASE_TEMPLATE("a method of a program's own has the oracle's gradients", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (auto const& e : expectations()) {
    if (e.scene.model.sh_degree != 1) continue;
    CAPTURE(e.scene.name);
    check_gradients<gart::tile_tracer<E>>(exec, e);
    check_gradients<gart::bvh_tracer<E>>(exec, e);
  }
}

TEST_CASE_TEMPLATE("a method of a program's own trains as the library's do", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  auto const data = capture(exec, seed);
  auto const expected = train<gart::primitive_method>(exec, data, seed);
  auto const got = train<geometry_method>(exec, data, seed);
  auto const without_room = train<geometry_method>(exec, data, seed, 1);
  CHECK(got.backward == "geometry");
  CHECK(without_room.backward == "pixel");
  for (std::size_t i = 0; i < expected.loss.size(); ++i) {
    CAPTURE(i);
    CHECK(got.loss[i] == doctest::Approx(expected.loss[i]).epsilon(2e-3));
    CHECK(without_room.loss[i] == doctest::Approx(expected.loss[i]).epsilon(2e-3));
  }
}
