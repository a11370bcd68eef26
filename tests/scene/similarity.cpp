// Scenes turned, scaled and moved: colours against the same function of turned directions, images against the same
// camera moved alike.

#include <gart/math/quaternion.hpp>
#include <gart/reference/reference.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/similarity.hpp>

#include <Eigen/Geometry>

#include <cmath>
#include <random>

#include "support/policies.hpp"

namespace {

using gart::mat3d;
using gart::vec3d;

mat3d rotation(std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  return gart::rotation_of({normal(random), normal(random), normal(random), normal(random)});
}

// Legendre functions by recurrence, with sines and cosines of the azimuth: no formula of the library's.
double harmonic(int l, int m, vec3d const& d) {
  int const a = std::abs(m);
  double const phi = std::atan2(d.y, d.x), x = d.z, s = std::sqrt(std::max(0.0, 1 - x * x));
  double p = 1, before = 0;
  for (int i = 1; i <= a; ++i) p *= -(2 * i - 1) * s;
  for (int i = a + 1; i <= l; ++i) {
    double const next = ((2 * i - 1) * x * p - (i + a - 1) * before) / (i - a);
    before = p, p = next;
  }
  double ratio = 1;
  for (int i = l - a + 1; i <= l + a; ++i) ratio *= i;
  double const norm = std::sqrt((2 * l + 1) / (4 * 3.14159265358979323846) / ratio);
  if (m == 0) return norm * p;
  return std::sqrt(2.0) * norm * p * (m > 0 ? std::cos(a * phi) : std::sin(a * phi));
}

double value(std::vector<float> const& c, vec3d const& d) {
  double sum = 0;
  for (int l = 0; l <= 3; ++l)
    for (int m = -l; m <= l; ++m)
      sum += static_cast<double>(c[static_cast<std::size_t>(3 * (l * l + l + m))]) * harmonic(l, m, d);
  return sum;
}

TEST_CASE("turned coefficients keep their values in turned directions") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 50; ++trial) {
    mat3d const r = trial ? rotation(random) : mat3d(1.0);
    gart::sh_rotation const turn(r);
    std::vector<float> c(48);
    for (float& v : c) v = static_cast<float>(normal(random));
    auto turned = c;
    turn.apply(turned.data(), 3);
    for (int i = 0; i < 10; ++i) {
      vec3d d(normal(random), normal(random), normal(random));
      d /= std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
      CHECK(value(turned, r * d) == doctest::Approx(value(c, d)).epsilon(1e-5));
    }
  }
}

TEST_CASE("a scene and a camera moved alike keep their image") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> normal;
  gart::gaussian_model model;
  model.resize(60, 3);
  for (float& v : model.mean) v = normal(random);
  for (float& v : model.log_scale) v = -1.5f + 0.5f * normal(random);
  for (float& v : model.quaternion) v = normal(random);
  for (float& v : model.opacity) v = normal(random);
  for (float& v : model.sh) v = 0.3f * normal(random);
  gart::camera view;
  view.width = view.height = 12, view.fx = view.fy = 12, view.cx = view.cy = 6, view.position = vec3d(0, 0, -5);
  std::vector<gart::u32> pixels(144);
  for (gart::u32 i = 0; i < 144; ++i) pixels[i] = i;
  gart::render_options options;
  auto const image = gart::trace_reference(model, view, options, 3, pixels);
  for (int trial = 0; trial < 4; ++trial) {
    gart::similarity s;
    s.rotation = rotation(random), s.scale = std::exp(static_cast<double>(normal(random)));
    s.translation = vec3d(normal(random), normal(random), normal(random));
    auto moved = model;
    gart::apply(s, moved);
    auto seen = view;
    auto near = options;
    near.near *= static_cast<float>(s.scale);
    seen.position = s(view.position);
    mat3d const axes = s.rotation * mat3d(view.rotation);
    seen.rotation = gart::mat3(axes);
    auto const again = gart::trace_reference(moved, seen, near, 3, pixels);
    // A hit at the very edge of its ellipsoid, of opacity alpha_min, may be one or none: leave those out.
    for (std::size_t i = 0; i < 144; ++i) {
      if (again.hits[i] != image.hits[i]) continue;
      for (std::size_t c = 0; c < 3; ++c)
        CHECK(again.color[3 * i + c] == doctest::Approx(image.color[3 * i + c]).epsilon(1e-4));
    }
  }
}

TEST_CASE("quaternions and matrices of rotations are each other's") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  for (int trial = 0; trial < 100; ++trial) {
    mat3d const r = rotation(random);
    auto const q = gart::quaternion_of(r);
    Eigen::Matrix3d const m = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix();
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) CHECK(m(i, j) == doctest::Approx(r[j][i]).epsilon(1e-9));
  }
}

TEST_CASE("what no similarity has is refused") {
  CHECK_THROWS_AS(gart::similarity_of({2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}), gart::invalid_argument);
  CHECK_THROWS_AS(gart::similarity_of({-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}), gart::invalid_argument);
  CHECK_THROWS_AS(gart::similarity_of({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 1, 1}), gart::invalid_argument);
  auto const s = gart::similarity_of({0, -2, 0, 5, 2, 0, 0, 6, 0, 0, 2, 7, 0, 0, 0, 1});
  CHECK(s.scale == doctest::Approx(2));
  vec3d const p = s(vec3d(1, 0, 0));
  CHECK(p.x == doctest::Approx(5));
  CHECK(p.y == doctest::Approx(8));
  CHECK(p.z == doctest::Approx(7));
}

}  // namespace
