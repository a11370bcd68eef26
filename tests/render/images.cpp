// Colour, transmittance, depth and hit counts of every scene against the oracle, and one tracer against another.
#include <render/expected.hpp>

#include <algorithm>
#include <cmath>

using namespace gart_test;

TEST_CASE_TEMPLATE("images agree with the oracle", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (auto const& e : expectations()) {
    auto const& s = e.scene;
    CAPTURE(s.name);
    auto const got = render_scene(exec, s.model, s.view, s.options, s.active_degree, tracer_kind::bvh);
    std::size_t const pixels = e.picture.pixels.size();
    REQUIRE(got.color.size() == 3 * pixels);
    REQUIRE(got.transmittance.size() == pixels);
    REQUIRE(got.depth.size() == pixels);
    REQUIRE(got.hits.size() == pixels);

    // Every pixel is checked: beyond the tolerance by no more than rounding explains, and by that in few pixels only.
    std::size_t aside = 0;
    double color_error = 0, transmittance_error = 0, depth_error = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      auto const& p = e.picture.pixels[i];
      double const allowed = within_rounding(p) ? 1 + 2 * p.rounding / image_tolerance : 1;
      double difference = 0;
      for (int c = 0; c < 3; ++c) {
        REQUIRE(std::isfinite(got.color[3 * i + c]));
        difference = std::max(difference, std::abs(got.color[3 * i + c] - p.color[c]));
      }
      aside += difference > image_tolerance;
      color_error = std::max(color_error, difference / allowed);
      if (p.edge) continue;

      double farthest = 1;
      for (auto const& h : p.list) farthest = std::max(farthest, std::abs(h.t) + h.t_slack / image_tolerance);
      transmittance_error = std::max(transmittance_error, std::abs(got.transmittance[i] - p.transmittance) / allowed);
      depth_error = std::max(depth_error, std::abs(got.depth[i] - p.depth) / (farthest * allowed));
      REQUIRE(got.hits[i] == p.hits);
    }
    CAPTURE(aside);
    CHECK(color_error <= image_tolerance);
    CHECK(transmittance_error <= image_tolerance);
    CHECK(depth_error <= image_tolerance);
    CHECK(aside <= 2 + pixels / 100);
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
