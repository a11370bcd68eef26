// The oracle against numbers worked out by hand.
#include <oracle/oracle.hpp>
#include <oracle/scenes.hpp>
#include <support/policies.hpp>

#include <cmath>

namespace {

// One pixel, looking down +z from the origin through the pixel's centre.
gart::camera one_pixel() {
  gart::camera c;
  c.width = c.height = 1;
  c.fx = c.fy = 1;
  c.cx = c.cy = 0.5f;
  return c;
}

void add(oracle::parameters& m, double x, double z, double scale_x, double logit, double grey) {
  for (double v : {x, 0.0, z}) m.mean.push_back(v);
  for (double v : {std::log(scale_x), 0.0, 0.0}) m.log_scale.push_back(v);
  for (double v : {2.0, 0.0, 0.0, 0.0}) m.quaternion.push_back(v);
  m.opacity.push_back(logit);
  for (int c = 0; c < 3; ++c) m.sh.push_back((grey - 0.5) / 0.28209479177387814);
}

gart::render_options options() {
  gart::render_options o;
  o.background = gart::vec3(0.25f);
  return o;
}

}  // namespace

TEST_CASE("one Gaussian off the axis") {
  oracle::parameters m;
  add(m, 0.5, 4.0, 0.5, 0.0, 0.75);
  auto const p = oracle::render(m, one_pixel(), options(), 0).pixels[0];
  double const alpha = 0.5 * std::exp(-0.5);
  CHECK(p.hits == 1);
  CHECK(p.list[0].t == doctest::Approx(4.0).epsilon(1e-12));
  CHECK(p.list[0].alpha == doctest::Approx(alpha).epsilon(1e-12));
  CHECK(p.depth == doctest::Approx(4.0 * alpha).epsilon(1e-12));
  CHECK(p.transmittance == doctest::Approx(1 - alpha).epsilon(1e-12));
  CHECK(p.color[1] == doctest::Approx(0.75 * alpha + 0.25 * (1 - alpha)).epsilon(1e-12));
  CHECK_FALSE(p.edge);
  CHECK_FALSE(p.kink);
}

TEST_CASE("the clamps, the thresholds and the hit that ends a ray") {
  oracle::parameters m;
  add(m, 0, 5.0, 1, 30.0, 1.0);   // held at 0.99, third in order
  add(m, 0, 3.0, 1, 30.0, -1.0);  // black by the clamp, first
  add(m, 0, 4.0, 1, -6.0, 1.0);   // alpha below 1/255
  add(m, 0, 6.0, 1, 30.0, 1.0);   // behind the end
  add(m, 0, -1.0, 1, 30.0, 1.0);  // behind the camera
  auto o = options();
  o.transmittance_min = 2e-4f;
  auto const p = oracle::render(m, one_pixel(), o, 0).pixels[0];
  REQUIRE(p.list.size() == 2);
  CHECK(p.list[0].id == 1);
  CHECK(p.list[0].clamps == 15);
  CHECK(p.list[1].id == 0);
  CHECK(p.transmittance == doctest::Approx(1e-4).epsilon(1e-9));
  CHECK(p.color[0] == doctest::Approx(0.01 * 0.99 + 1e-4 * 0.25).epsilon(1e-9));
  auto capped = o;
  capped.max_hits = 1;
  auto const first = oracle::render(m, one_pixel(), capped, 0).pixels[0];
  CHECK(first.list.size() == 1);
  CHECK(first.color[0] == doctest::Approx(0.01 * 0.25).epsilon(1e-9));

  auto const g = oracle::gradients(m, one_pixel(), o, 0, {1, 1, 1});
  CHECK(g.opacity[0] == 0);
  CHECK(g.sh[3] == 0);
  CHECK(g.sh[0] == doctest::Approx(0.01 * 0.99 * 0.28209479177387814).epsilon(1e-9));
}

TEST_CASE("what rounding could turn is marked") {
  oracle::parameters sure, alpha, clamp, held, color;
  double const alpha_min = 1.0f / 255.0f;
  add(sure, 0, 3.0, 1, 0.0, 0.7);
  add(alpha, 0, 3.0, 1, std::log(alpha_min / (1 - alpha_min)), 0.7);
  add(clamp, 0, 3.0, 1, std::log(99.0), 0.7);
  add(held, 0, 3.0, 1, std::log(99.0) + 0.01, 0.7);
  add(color, 0, 3.0, 1, 0.0, 0.0);
  auto const pixel_of = [](oracle::parameters const& m, gart::render_options const& o) {
    return oracle::render(m, one_pixel(), o, 0).pixels[0];
  };
  auto const p = pixel_of(sure, options());
  CHECK_FALSE(p.edge);
  CHECK_FALSE(p.kink);
  CHECK(p.rounding < 1e-5);
  CHECK(pixel_of(alpha, options()).edge);
  CHECK(pixel_of(clamp, options()).kink);
  CHECK_FALSE(pixel_of(held, options()).kink);  // surely held, and surely without a derivative
  CHECK(pixel_of(color, options()).kink);
  auto at_near = options();
  at_near.near = 3.0f;
  CHECK(pixel_of(sure, at_near).edge);
  auto at_end = options();
  at_end.transmittance_min = 0.5f;
  CHECK(pixel_of(sure, at_end).edge);

  oracle::parameters tied = sure, twice = sure;
  add(tied, 0, 3.0 + 1e-9, 1, 0.0, 0.2);
  add(twice, 0, 3.0, 1, 0.0, 0.2);
  CHECK(pixel_of(tied, options()).rounding > 0.1);
  CHECK(pixel_of(twice, options()).rounding < 1e-5);
  CHECK(pixel_of(twice, options()).list[0].id == 0);
}

TEST_CASE("a ray meets the point that the lens sends to its pixel") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  for (auto const& s : oracle::scenes(seed)) {
    CAPTURE(s.name);
    auto const& c = s.view;
    for (int j = 0; j < c.height; ++j)
      for (int i = 0; i < c.width; ++i) {
        auto const d = oracle::ray_through(c, i, j);
        double camera[3];  // R^T d, R a rotation to float rounding
        for (int a = 0; a < 3; ++a)
          camera[a] = c.rotation[a][0] * d.x + c.rotation[a][1] * d.y + c.rotation[a][2] * d.z;
        double const x = camera[0] / camera[2], y = camera[1] / camera[2], r2 = x * x + y * y;
        double const radial = 1 + c.lens.k1 * r2 + c.lens.k2 * r2 * r2;
        double const u = c.fx * (x * radial + 2 * c.lens.p1 * x * y + c.lens.p2 * (r2 + 2 * x * x)) + c.cx;
        double const v = c.fy * (y * radial + c.lens.p1 * (r2 + 2 * y * y) + 2 * c.lens.p2 * x * y) + c.cy;
        REQUIRE(std::abs(u - (i + 0.5)) < 1e-4);
        REQUIRE(std::abs(v - (j + 0.5)) < 1e-4);
        REQUIRE(std::abs(d.x * d.x + d.y * d.y + d.z * d.z - 1) < 1e-14);
      }
  }
}
