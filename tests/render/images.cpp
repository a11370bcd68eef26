// Colour, transmittance, depth and hit counts of every scene against the oracle, and one tracer against another.
#include <render/expected.hpp>

using namespace gart_test;

TEST_CASE_TEMPLATE("images agree with the oracle", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (auto const& e : expectations()) {
    auto const& s = e.scene;
    CAPTURE(s.name);
    auto const got = render_scene(exec, s.model, s.view, s.options, s.active_degree, tracer_kind::bvh);
    auto const error = image_error(got, e.picture);
    CHECK(error.color <= image_tolerance);
    CHECK(error.transmittance <= image_tolerance);
    CHECK(error.depth <= image_tolerance);
    CHECK(error.aside <= 2 + e.picture.pixels.size() / 100);
  }
}

TEST_CASE_TEMPLATE("all tracers give the same image, bit for bit", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (auto const& e : expectations()) {
    auto const& s = e.scene;
    CAPTURE(s.name);
    auto const first = render_scene(exec, s.model, s.view, s.options, s.active_degree, tracer_kind::bvh);
    for (auto kind : tracers<E>()) {
      auto const other = render_scene(exec, s.model, s.view, s.options, s.active_degree, kind);
      CHECK(first.color == other.color);
      CHECK(first.transmittance == other.transmittance);
      CHECK(first.depth == other.depth);
      CHECK(first.hits == other.hits);
    }
  }
}
