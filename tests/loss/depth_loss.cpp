// The depth's loss and its gradients against the definition in double, where A weighs a pixel and is held fixed.
#include <support/policies.hpp>

#include <gart/loss/depth_loss.hpp>

#include <cmath>
#include <random>

using namespace gart;

TEST_CASE_TEMPLATE("the depth loss is its definition, gradients its differences", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<float> uniform(0, 1);
  std::size_t const n = 5000;
  float const scale = 0.7f;
  std::vector<float> depth, transmittance, distance;
  std::vector<u8> mask;
  for (std::size_t i = 0; i < n; ++i) {
    float const seen = i % 7 == 0 ? 0.0f : i % 7 == 1 ? 0.004f : uniform(random);
    transmittance.push_back(1 - seen);
    depth.push_back((1 - transmittance.back()) * (1 + 9 * uniform(random)));
    distance.push_back(i % 5 == 0 ? 0.0f : 1 + 9 * uniform(random));
    mask.push_back(i % 11 == 0 ? 0 : 255);
  }
  auto const of_pixel = [&](std::size_t i, double d, double t) {
    double const weight = 1.0 - transmittance[i];
    if (!(distance[i] > 0) || !(weight > 0) || mask[i] == 0) return 0.0;
    return scale / static_cast<double>(n) * weight * std::abs(d / (1 - t) - distance[i]);
  };
  E exec;
  buffer<float, E> d(exec, depth), t(exec, transmittance), z(exec, distance), by_d(exec, n), by_t(exec, n),
      loss(exec, 1);
  buffer<u8, E> m(exec, mask);
  truth_view truth;
  truth.mask = m.data();
  depth_loss<E> made(exec);
  made.evaluate({d, t, by_d, by_t}, z.data(), truth, scale, loss);
  auto const got_d = by_d.to_host(), got_t = by_t.to_host();
  double expected = 0;
  for (std::size_t i = 0; i < n; ++i) {
    expected += of_pixel(i, depth[i], transmittance[i]);
    double const seen = 1.0 - transmittance[i];
    if (seen > 0 && std::abs(depth[i] / seen - distance[i]) < 1e-2) continue;  // at the kink
    double const h = 1e-6 * seen;
    auto const slope = [&](double at_d, double at_t) {
      return (of_pixel(i, depth[i] + h * at_d, transmittance[i] + h * at_t) -
              of_pixel(i, depth[i] - h * at_d, transmittance[i] - h * at_t)) /
             (2 * h);
    };
    double const weight = seen > 0 ? 1 / (2 * h) : 0;
    double const want_d = weight > 0 ? slope(1, 0) : 0, want_t = weight > 0 ? slope(0, 1) : 0;
    double const size = scale / static_cast<double>(n);
    CHECK(std::abs(got_d[i] - want_d) <= 1e-4 * size);
    CHECK(std::abs(got_t[i] - want_t) <= 1e-3 * size);
  }
  CHECK(loss.to_host()[0] == doctest::Approx(expected).epsilon(1e-5));
}
