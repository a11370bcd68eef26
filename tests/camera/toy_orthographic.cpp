// A model without a centre, whose rays have origins, by every tracer.
#include "toy_orthographic.hpp"
#include "seam.hpp"

TEST_CASE_TEMPLATE("parallel rays of a test's own are traced through the seam", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> normal;
  E exec;
  for (int trial = 0; trial < 3; ++trial) {
    gart::camera c;
    c.width = 60, c.height = 53;
    c.rotation = gart::to_matrix({normal(random), normal(random), normal(random), normal(random)});
    c.position = {10 * normal(random), 10 * normal(random), 10 * normal(random)};
    gart_test::toy_orthographic const view(c, 0.2f);
    gart_test::check_hits(exec, view, gart_test::gaussians_around(c.position, 3, 500, random));
  }
}
