// Fainter, larger, as ellipsoids, as points: what is traced is what closed forms say.
#include "cameras.hpp"

#include <gart/math/logit.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/view/model_view.hpp>

#include <doctest/doctest.h>

#include <cmath>

namespace {

// One Gaussian at the origin, 0.3 x 0.1 x 0.2, of opacity 0.5, red.
gart::gaussian_model one(float opacity = 0.5f) {
  gart::gaussian_model m;
  m.resize(1, 0);
  m.log_scale = {std::log(0.3f), std::log(0.1f), std::log(0.2f)}, m.quaternion = {1, 0, 0, 0};
  m.opacity = {std::log(opacity / (1 - opacity))};
  float const dc = 0.5f / 0.28209479f;
  m.sh = {dc, -dc, -dc};
  return m;
}

gart::view_settings with(auto const& set) {
  gart::view_settings s;
  set(s);
  return s;
}

struct shown {
  std::unique_ptr<gart::renderer> by;
  gart::view_render render;
  explicit shown(gart::gaussian_model const& m) {
    gart::configuration_request r;
    r.backend = gart::backend_kind::serial, r.sh_degree = m.sh_degree;
    by = gart::make_renderer(r);
    render = gart::render_of(*by, m, {});
  }
  // 1 - T at a place of the plane through the origin.
  float alpha(gart::view_settings const& s, double x, double y) const {
    gart::camera c = gart_test::camera_at({0, 0, -400}, 0, 1, 1);
    c.fx = c.fy = 1000, c.position.x = x, c.position.y = y, c.cx = c.cy = 0.5f;
    return 1 - render.images(c, s).transmittance.at(0, 0, 0);
  }
};

}  // namespace

TEST_CASE("opacity and size are factors") {
  shown const view(one());
  CHECK(view.alpha({}, 0, 0) == doctest::Approx(0.5).epsilon(1e-3));
  CHECK(view.alpha({}, 0.3, 0) == doctest::Approx(0.5 * std::exp(-0.5)).epsilon(1e-2));
  CHECK(view.alpha(with([](auto& s) { s.opacity = 0.2f; }), 0, 0) == doctest::Approx(0.1).epsilon(1e-3));
  CHECK(view.alpha(with([](auto& s) { s.opacity = 10; }), 0, 0) == doctest::Approx(0.99).epsilon(1e-3));  // the most
  CHECK(view.alpha(with([](auto& s) { s.size = 2; }), 0.6, 0) == doctest::Approx(0.5 * std::exp(-0.5)).epsilon(1e-2));
  CHECK(view.alpha({}, 0, 0) == doctest::Approx(0.5).epsilon(1e-3));
}

TEST_CASE("an ellipsoid is solid to one standard deviation") {
  shown const view(one());
  auto const solid = with([](auto& s) { s.shape = gart::view_shape::ellipsoids; });
  CHECK(view.alpha(solid, 0, 0) > 0.98f);
  for (double side : {-1.0, 1.0}) {
    CHECK(view.alpha(solid, side * 0.29, 0) > 0.79f);
    CHECK(view.alpha(solid, side * 0.31, 0) == 0);
    CHECK(view.alpha(solid, 0, side * 0.097) > 0.79f);
    CHECK(view.alpha(solid, 0, side * 0.103) == 0);
  }
  auto const larger = with([](auto& s) { s.shape = gart::view_shape::ellipsoids, s.size = 2; });
  CHECK(view.alpha(larger, 0.58, 0) > 0.79f);
  CHECK(view.alpha(larger, 0.62, 0) == 0);
  // What is too faint is left out, by the factor of opacity too.
  auto const fainter = with([](auto& s) { s.shape = gart::view_shape::ellipsoids, s.opacity = 0.09f; });
  CHECK(view.alpha(fainter, 0, 0) == 0);
}

TEST_CASE("a point is a ball of one size, of 0.004 of the extent") {
  gart::gaussian_model m = one();
  m.resize(3, 0);
  m.mean[3] = -5, m.mean[6] = 5;  // the bounds leave out the last: from -5 to 0, half of which is 2.5
  for (std::size_t i = 1; i < 3; ++i) m.quaternion[4 * i] = 1;
  shown const view(m);
  auto const points = with([](auto& s) { s.shape = gart::view_shape::points; });
  CHECK(view.alpha(points, 0, 0) > 0.98f);
  for (double r : {-0.0095, 0.0095}) CHECK(view.alpha(points, r, 0) > 0.79f);
  for (double r : {-0.0105, 0.0105}) CHECK(view.alpha(points, 0, r) == 0);
}

TEST_CASE("a view has its own background, and parts the whole's bits") {
  shown const view(one());
  gart::camera const c = gart_test::camera_at({0, 0, -2}, 0.05, 70, 100);
  auto const white = view.render.images(c, with([](auto& s) { s.background = gart::vec3(1.0f); }));
  CHECK(white.color.at(0, 0, 1) == 1);
  auto const whole = view.render.images(c, {});
  REQUIRE(view.render.in_parts);
  for (gart::image_rows rows : {gart::image_rows{0, 32}, gart::image_rows{32, 64}, gart::image_rows{64, 128}}) {
    auto const part = view.render.images(c, with([&](auto& s) { s.rows = rows; }));
    for (int y = rows.first; y < std::min(rows.end, 100); ++y)
      for (int x = 0; x < 70; ++x) {
        CHECK(part.color.at(x, y, 0) == whole.color.at(x, y, 0));
        CHECK(part.transmittance.at(x, y, 0) == whole.transmittance.at(x, y, 0));
      }
  }
}
