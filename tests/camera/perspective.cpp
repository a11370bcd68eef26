// The models that project slopes, held to the seam.
#include "seam.hpp"

namespace {

gart::camera perspective(std::mt19937_64& random, bool lens) {
  std::normal_distribution<float> normal;
  gart::camera c;
  c.width = 61, c.height = 45;
  c.fx = 40, c.fy = 42, c.cx = 30, c.cy = 22.5f;
  if (lens) c.lens = {0.08f, 0.02f, 0.005f, -0.003f};
  c.rotation = gart::to_matrix({normal(random), normal(random), normal(random), normal(random)});
  c.position = {10 * normal(random), 10 * normal(random), 10 * normal(random)};
  return c;
}

}  // namespace

TEST_CASE_TEMPLATE("pinholes and OpenCV lenses are traced through the seam", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  for (int trial = 0; trial < 4; ++trial) {
    gart::camera const c = perspective(random, trial % 2);
    auto const model = gart_test::gaussians_around(c.position, 3, 500, random);
    gart::visit_camera(c, [&](auto const& view) {
      using model_type = std::decay_t<decltype(view)>;
      if constexpr (std::is_same_v<model_type, gart::pinhole> || std::is_same_v<model_type, gart::opencv>) {
        gart_test::check_hits(exec, view, model);
        gart_test::check_image(exec, view, model);
        gart_test::check_gradients(exec, view, model);
      } else {
        FAIL("another model");
      }
    });
  }
}
