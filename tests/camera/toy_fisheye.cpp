// A model of a test's own, beyond half a sphere, by every tracer.
#include "toy_fisheye.hpp"
#include "seam.hpp"

TEST_CASE_TEMPLATE("a fisheye of a test's own is traced through the seam", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> normal;
  E exec;
  for (int trial = 0; trial < 3; ++trial) {
    gart::camera c;
    c.width = 60, c.height = 53;
    c.fx = 17, c.cx = 30, c.cy = 26;  // 260 degrees from corner to corner
    c.rotation = gart::to_matrix({normal(random), normal(random), normal(random), normal(random)});
    c.position = {10 * normal(random), 10 * normal(random), 10 * normal(random)};
    gart_test::toy_fisheye const view(c);
    CHECK(view.one_to_one());
    auto const model = gart_test::gaussians_around(c.position, 3, 500, random);
    gart_test::check_hits(exec, view, model);
    gart_test::check_image(exec, view, model);
    gart_test::check_gradients(exec, view, model);
  }
}

TEST_CASE("its rays are the model's, in double") {
  gart::camera c;
  c.width = 60, c.height = 53, c.fx = 17, c.cx = 30, c.cy = 26;
  gart_test::toy_fisheye const view(c);
  for (int y = 0; y < c.height; ++y)
    for (int x = 0; x < c.width; ++x) {
      gart::vec3 const d = view.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f).direction;
      double const r = std::hypot(x + 0.5 - 30, y + 0.5 - 26), theta = std::atan2(std::hypot(d.x, d.y), d.z);
      CHECK(17 * theta == doctest::Approx(r).epsilon(1e-5));
      CHECK(d.x * (y + 0.5 - 26) == doctest::Approx(d.y * (x + 0.5 - 30)).epsilon(1e-4));
    }
}
