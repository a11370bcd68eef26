// Parallel rays: held to the seam; where points lie, and boxes, in closed form.
#include "seam.hpp"

namespace {

gart::camera orthographic(std::mt19937_64& random, int width, int height) {
  std::normal_distribution<float> normal;
  gart::camera c;
  c.kind = gart::camera_kind::orthographic;
  c.width = width, c.height = height;
  c.fx = 5, c.fy = 5.5f, c.cx = 0.48f * static_cast<float>(width), c.cy = 0.53f * static_cast<float>(height);
  c.rotation = gart::to_matrix({normal(random), normal(random), normal(random), normal(random)});
  c.position = {10 * normal(random), 10 * normal(random), 10 * normal(random)};
  return c;
}

}  // namespace

TEST_CASE_TEMPLATE("an orthographic camera is traced through the seam", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  for (int trial = 0; trial < 3; ++trial) {
    gart::orthographic const view(orthographic(random, 60, 53));
    auto const model = gart_test::gaussians_around(view.position, 3, 500, random);
    gart_test::check_hits(exec, view, model);
    gart_test::check_image(exec, view, model);
    gart_test::check_gradients(exec, view, model);
  }
}

TEST_CASE("parallel rays pass their points, and boxes hold ellipsoids") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<double> normal;
  auto const uniform = [&](double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); };
  gart::camera const c = orthographic(random, 4096, 4096);
  gart::vec3d const x(c.rotation[0]), y(c.rotation[1]), z(c.rotation[2]);
  gart::ray const r = gart::ray_through(c, 1234.5f, 3000.5f);
  CHECK(glm::dot(gart::vec3d(r.direction), z) == doctest::Approx(1));
  CHECK(glm::dot(gart::vec3d(r.origin), x) * double{c.fx} + double{c.cx} == doctest::Approx(1234.5));
  CHECK(glm::dot(gart::vec3d(r.origin), y) * double{c.fy} + double{c.cy} == doctest::Approx(3000.5));
  CHECK(std::abs(glm::dot(gart::vec3d(r.origin), z)) < 1e-4);

  constexpr float near = 0.5f;
  auto const bounds = gart::orthographic(c).bounds(near);
  constexpr int trials = 2000, around = 4000;
  double ratio = 0;
  int measured = 0, outside = 0, crossing = 0;
  for (int i = 0; i < trials; ++i) {
    gart::ellipsoid e;
    double const depth = uniform(-2, 20), size = std::exp(uniform(-1, 3));
    e.center = x * uniform(-300, 300) + y * uniform(-300, 300) + z * depth;
    for (int k = 0; k < 3; ++k) e.axes[k] = gart::vec3d(normal(random), normal(random), normal(random)) * size;
    gart::footprint const f = bounds(e);
    // Points of the ellipsoid in front: of its surface, and of the section with the near plane, sampled.
    double lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300};
    bool front = true, seen = false;
    gart::vec3d const down = glm::transpose(e.axes) * z;
    double const half = glm::length(down);
    for (int k = 0; k < around; ++k) {
      gart::vec3d s = glm::normalize(gart::vec3d(normal(random), normal(random), normal(random)));
      double const zs = glm::dot(e.center + e.axes * s, z);
      if (zs < near) {
        front = false;
        // Onto the section, where there is one: the part along the plane's normal is given, the rest is scaled.
        double const along = (near - glm::dot(e.center, z)) / half;
        if (std::abs(along) >= 1) continue;
        gart::vec3d const n = down / half, side = s - n * glm::dot(s, n);
        s = n * along + glm::normalize(side) * std::sqrt(1 - along * along);
      }
      seen = true;
      gart::vec3d const p = e.center + e.axes * s;
      double const at[2] = {glm::dot(p, x) * double{c.fx} + double{c.cx}, glm::dot(p, y) * double{c.fy} + double{c.cy}};
      for (int j = 0; j < 2; ++j) lo[j] = std::min(lo[j], at[j]), hi[j] = std::max(hi[j], at[j]);
    }
    if (!seen) continue;
    crossing += !front;
    auto const first = [](double edge) { return static_cast<int>(std::clamp(std::ceil(edge - 0.5), 0.0, 4096.0)); };
    int const x0 = first(lo[0]), x1 = first(hi[0]), y0 = first(lo[1]), y1 = first(hi[1]);
    if (x1 <= x0 || y1 <= y0) continue;
    outside += x0 < f.box.x0 || x1 > f.box.x1 || y0 < f.box.y0 || y1 > f.box.y1;
    double const exact = double(x1 - x0) * (y1 - y0);
    if (exact < 400) continue;
    ++measured, ratio += f.box.area() / exact;
  }
  CAPTURE(crossing);
  CHECK(crossing > 100);
  CHECK(outside == 0);
  CHECK(measured > 500);
  CAPTURE(ratio / measured);
  CHECK(ratio / measured < 1.1);  // what samples leave of the border among it
}
