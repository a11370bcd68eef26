// Poses in double: turns there and back, moves and what lies between, and gradients pulled back against differences.
#include <gart/pose/pose.hpp>
#include <support/policies.hpp>

#include <cmath>
#include <random>

using namespace gart_test;

namespace {

gart::vec3d some(std::mt19937_64& random, double size) {
  std::normal_distribution<double> normal;
  return {size * normal(random), size * normal(random), size * normal(random)};
}

double distance(gart::mat3d const& a, gart::mat3d const& b) {
  double sum = 0;
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) sum += (a[j][i] - b[j][i]) * (a[j][i] - b[j][i]);
  return std::sqrt(sum);
}

// The series of exp([w]x).
gart::mat3d series(gart::vec3d const& w) {
  gart::mat3d const cross(gart::vec3d(0, w.z, -w.y), gart::vec3d(-w.z, 0, w.x), gart::vec3d(w.y, -w.x, 0));
  gart::mat3d sum(1.0), term(1.0);
  for (int k = 1; k < 60; ++k) {
    term = cross * term;
    for (int j = 0; j < 3; ++j) term[j] /= k;
    for (int j = 0; j < 3; ++j) sum[j] += term[j];
  }
  return sum;
}

gart::camera some_camera(std::mt19937_64& random) {
  gart::camera c;
  c.width = c.height = 8, c.fx = c.fy = 8, c.cx = c.cy = 4;
  gart::mat3d const axes = series(some(random, 1));
  for (int k = 0; k < 3; ++k) c.rotation[k] = gart::vec3(axes[k]);
  c.position = some(random, 3);
  return c;
}

}  // namespace

TEST_CASE("a turn is the exponential's series and inverts") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (double const size : {0.0, 1e-9, 1e-5, 1e-3, 0.1, 1.0}) {
    CAPTURE(size);
    gart::vec3d const w = some(random, size);
    gart::mat3d const turn = gart::turn_of(w);
    CHECK(distance(turn, series(w)) < 1e-12);
    double const angle = std::sqrt(w.x * w.x + w.y * w.y + w.z * w.z);
    if (angle >= 3.1) continue;
    gart::vec3d const back = gart::angles_of(turn);
    for (int k = 0; k < 3; ++k) CHECK(std::abs(back[k] - w[k]) < 1e-9 * (1 + angle));
  }
  for (int k = 0; k < 3; ++k) {
    gart::vec3d half(0.0);
    half[k] = std::acos(-1.0);
    CHECK(distance(gart::turn_of(gart::angles_of(gart::turn_of(half))), gart::turn_of(half)) < 1e-6);
  }
}

TEST_CASE("a moved camera is as far away as it was moved") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (int trial = 0; trial < 20; ++trial) {
    gart::camera const c = some_camera(random);
    gart::vec3d const t = some(random, 0.3), w = some(random, 0.3);
    gart::pose_numbers const by{t.x, t.y, t.z, w.x, w.y, w.z};
    gart::camera const to = gart::moved(c, by, 2.5);
    CHECK(to.fx == c.fx);
    gart::mat3d const back = glm::transpose(gart::axes_of(c));
    CHECK(glm::length(back * (to.position - c.position) - 2.5 * t) < 1e-6);
    CHECK(glm::length(gart::angles_of(back * gart::axes_of(to)) - w) < 1e-6);
  }
}

TEST_CASE("pose gradients are the function's, at any distance") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  for (double const size : {0.0, 1e-4, 0.1, 1.0}) {
    CAPTURE(size);
    gart::camera const c = some_camera(random);
    gart::vec3d const t = some(random, size), w = some(random, size), point = some(random, 1), along = some(random, 1);
    gart::pose_numbers const at{t.x, t.y, t.z, w.x, w.y, w.z};
    // f = along . R R_at^T point + along . position, whose gradient by a turn is R_at^T point x along where it stands.
    auto const axes = [&](gart::pose_numbers const& x) { return gart::axes_of(c) * gart::turn_of({x[3], x[4], x[5]}); };
    gart::mat3d const back = glm::transpose(axes(at));
    auto const f = [&](gart::pose_numbers const& x) {
      gart::vec3d const position = c.position + gart::axes_of(c) * gart::vec3d(x[0], x[1], x[2]) * 1.7;
      return glm::dot(along, axes(x) * (back * point)) + glm::dot(along, position);
    };
    gart::pose_gradient g;
    g.translation = along, g.rotation = glm::cross(point, along);
    gart::pose_numbers const got = gart::pull_back(c, at, 1.7, g);
    for (std::size_t k = 0; k < 6; ++k) {
      double const h = 1e-5;
      gart::pose_numbers plus = at, minus = at;
      plus[k] += h, minus[k] -= h;
      CHECK(got[k] == doctest::Approx((f(plus) - f(minus)) / (2 * h)).epsilon(1e-6));
    }
  }
}
