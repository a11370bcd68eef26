#include <support/policies.hpp>

#include <gart/train/densify/adc.hpp>

#include "models.hpp"

#include <algorithm>

using namespace gart;
using gart_test::logit;

namespace {

// Small, half-opaque Gaussians in front of the camera, tagged by their first colour coefficient; extent 1.
gaussian_model plain(index_t n, std::mt19937_64& random) {
  gaussian_model m = gart_test::random_model(n, 1, random);
  for (auto& s : m.log_scale) s = std::log(0.002f);
  for (auto& o : m.opacity) o = 0;
  for (index_t i = 0; i < n; ++i) m.sh[i * 12] = static_cast<float>(i);
  return m;
}

template <class E>
struct training : gart_test::with_moments<E> {
  adaptive_density<E> density;

  explicit training(gaussian_model const& m, index_t most = 1000, adc_options const& options = {})
      : gart_test::with_moments<E>(m), density(this->exec, options, most, 30000, 1.0f, 5) {}
  void statistic(std::vector<float> const& mean_gradient) {
    density.gradient_sum.assign(mean_gradient);
    density.touched.assign(std::vector<u32>(mean_gradient.size(), 1));
  }
  std::vector<int> tags() {
    gaussian_model const m = this->model.to_host();
    std::vector<int> out;
    for (std::size_t i = 0; i < m.size(); ++i) out.push_back(static_cast<int>(m.sh[i * 12]));
    return out;
  }
};

}  // namespace

TEST_CASE_TEMPLATE("the statistic is the gradient in the projected mean", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  camera view;
  view.width = 640, view.height = 480, view.fx = 500, view.fy = 450, view.cx = 300, view.cy = 250;
  // A rotation by 0.7 about y and then 0.4 about x.
  double const cy = std::cos(0.7), sy = std::sin(0.7), cx = std::cos(0.4), sx = std::sin(0.4);
  double const r[3][3] = {{cy, sy * sx, sy * cx}, {0, cx, -sx}, {-sy, cy * sx, cy * cx}};
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) view.rotation[column][row] = static_cast<float>(r[row][column]);
  view.position = vec3d(0.3, -0.2, -4);

  index_t const n = 50;
  gaussian_model const m = plain(n, random);
  training<E> t(m);
  gaussian_model g = m;
  std::vector<double> expected(n);
  for (index_t i = 0; i < n; ++i) {
    // A loss a * ndc_x + b * ndc_y of the projected mean; its gradient in the mean by finite differences.
    double const a = i == 4 ? 0 : std::cos(i), b = i == 4 ? 0 : std::sin(2.0 * i);
    auto const loss = [&](double const p[3]) {
      double c[3] = {};
      for (int column = 0; column < 3; ++column)
        for (int row = 0; row < 3; ++row) c[column] += r[row][column] * (p[row] - view.position[row]);
      double const u = 500 * c[0] / c[2] + 300, v = 450 * c[1] / c[2] + 250;
      return a * (2 * u / 640 - 1) + b * (2 * v / 480 - 1);
    };
    for (int c = 0; c < 3; ++c) {
      double p[3] = {m.mean[3 * i], m.mean[3 * i + 1], m.mean[3 * i + 2]};
      p[c] += 1e-5;
      double const above = loss(p);
      p[c] -= 2e-5;
      g.mean[3 * i + c] = static_cast<float>((above - loss(p)) / 2e-5);
    }
    g.opacity[i] = i == 4 ? 0.0f : 1.0f;
    expected[i] = std::sqrt(a * a + b * b);
  }
  gaussians<E> gradient(t.exec, g);
  t.density.observe(t.model, gradient, view);
  t.density.observe(t.model, gradient, view);
  g.mean[0] = NAN;
  gradient.assign(g);
  t.density.observe(t.model, gradient, view);
  auto const sum = t.density.gradient_sum.to_host();
  auto const touched = t.density.touched.to_host();
  for (index_t i = 0; i < n; ++i) {
    u32 const steps = i == 4 ? 0 : i == 0 ? 2 : 3;
    CHECK(touched[i] == steps);
    CHECK(sum[i] == doctest::Approx(steps * expected[i]).epsilon(1e-4));
  }
  // Behind the camera nothing is added.
  view.position = vec3d(0, 0, 0), view.rotation = mat3(1.0f);
  gaussian_model behind = m;
  for (index_t i = 0; i < n; ++i) behind.mean[3 * i + 2] = -1;
  t.model.assign(behind);
  t.density.observe(t.model, gradient, view);
  CHECK(t.density.gradient_sum.to_host() == sum);
}

TEST_CASE_TEMPLATE("keep, clone, split and prune", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  gaussian_model m = plain(8, random);
  // 0 kept, 1 cloned, 2 split, 3 transparent, 4 transparent though growing, 5 broken, 6 kept though huge, 7 cloned.
  m.log_scale[3 * 2 + 1] = std::log(0.05f);
  m.opacity[3] = m.opacity[4] = static_cast<float>(logit(0.004));
  m.mean[3 * 5] = NAN;
  m.log_scale[3 * 6] = std::log(0.5f);
  training<E> t(m);
  t.statistic({1e-4f, 3e-4f, 3e-4f, 0, 1, 1, 0, 2e-4f});
  density_change const change = t.density.densify(t, {600});
  CHECK(change.added == 3);
  CHECK(change.removed == 3);
  CHECK(t.tags() == std::vector<int>{0, 1, 1, 2, 2, 6, 7, 7});
  gaussian_model got = t.model.to_host(), first = t.moments.first.to_host(), second = t.moments.second.to_host();
  bool const fresh[] = {false, false, true, true, true, false, false, true};
  for (index_t i = 0; i < 8; ++i) {
    CHECK(gart_test::all_zero(gart_test::row(first, i)) == fresh[i]);
    CHECK(gart_test::all_zero(gart_test::row(second, i)) == fresh[i]);
  }
  CHECK(gart_test::row(got, 0) == gart_test::row(m, 0));
  CHECK(gart_test::row(got, 1) == gart_test::row(m, 1));
  CHECK(gart_test::row(got, 2) == gart_test::row(m, 1));
  CHECK(gart_test::row(got, 5) == gart_test::row(m, 6));
  for (index_t i = 3; i < 5; ++i) {
    for (int c = 0; c < 3; ++c) CHECK(got.log_scale[3 * i + c] == doctest::Approx(m.log_scale[6 + c] - std::log(1.6)));
    CHECK(got.opacity[i] == m.opacity[2]);
    CHECK(got.mean[3 * i] != m.mean[6]);
  }
  CHECK(got.mean[9] != got.mean[12]);
  CHECK(t.density.touched.size() == 8);
  CHECK(t.density.gradient_sum.to_host() == std::vector<float>(8, 0.0f));
}

TEST_CASE_TEMPLATE("children of a split are draws from the Gaussian", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  index_t const n = 20000;
  gaussian_model m = plain(n, random);
  for (index_t i = 0; i < n; ++i) {
    m.log_scale[3 * i] = std::log(0.3f), m.log_scale[3 * i + 1] = std::log(0.1f);
    // A turn of 90 degrees about z, not of unit length: the long axis lies along y.
    m.quaternion[4 * i] = m.quaternion[4 * i + 3] = 2, m.quaternion[4 * i + 1] = m.quaternion[4 * i + 2] = 0;
  }
  training<E> t(m, 2 * n);
  t.statistic(std::vector<float>(n, 1.0f));
  t.density.densify(t, {600});
  gaussian_model const got = t.model.to_host();
  REQUIRE(got.size() == 2 * n);
  double square[3] = {}, sum[3] = {};
  for (index_t i = 0; i < 2 * n; ++i)
    for (int c = 0; c < 3; ++c) {
      double const d = got.mean[3 * i + c] - static_cast<double>(m.mean[3 * (i / 2) + c]);
      sum[c] += d / (2 * n), square[c] += d * d / (2 * n);
    }
  CHECK(square[0] == doctest::Approx(0.01).epsilon(0.05));
  CHECK(square[1] == doctest::Approx(0.09).epsilon(0.05));
  CHECK(square[2] == doctest::Approx(4e-6).epsilon(0.05));
  CHECK(std::abs(sum[1]) < 0.01);
}

TEST_CASE_TEMPLATE("oversized ones go after the first reset of opacities", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  gaussian_model m = plain(3, random);
  m.log_scale[0] = std::log(0.2f), m.log_scale[3] = std::log(0.15f);  // 0 grows: its children are 0.125; 1: kept size
  training<E> early(m), late(m);
  early.statistic({1, 0, 0}), late.statistic({1, 0, 0});
  early.density.densify(early, {3000});
  CHECK(early.tags() == std::vector<int>{0, 0, 1, 2});
  late.density.densify(late, {3100});
  CHECK(late.tags() == std::vector<int>{2});
}

TEST_CASE_TEMPLATE("at the budget the largest statistics grow", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  training<E> t(plain(6, random), 8);
  t.statistic({0.5f, 0.1f, 0.9f, 0, 0.7f, 0.3f});
  CHECK(t.density.densify(t, {600}).added == 2);
  CHECK(t.tags() == std::vector<int>{0, 1, 2, 2, 3, 4, 4, 5});

  training<E> full(plain(6, random), 4);
  full.statistic(std::vector<float>(6, 1.0f));
  CHECK(!full.density.densify(full, {600}).any());
  CHECK(full.model.size() == 6);
}

TEST_CASE_TEMPLATE("opacities are reset, with their moments", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  gaussian_model m = plain(3, random);
  m.opacity = {2.0f, static_cast<float>(logit(0.006)), static_cast<float>(logit(0.02))};
  training<E> t(m);
  CHECK(!t.density.step(t, {2999}).any());
  CHECK(t.model.to_host().opacity == m.opacity);
  t.density.step(t, {3000});
  gaussian_model const got = t.model.to_host();
  CHECK(gart_test::sigmoid(got.opacity[0]) == doctest::Approx(0.01));
  CHECK(got.opacity[1] == m.opacity[1]);
  CHECK(gart_test::sigmoid(got.opacity[2]) == doctest::Approx(0.01));
  CHECK(t.moments.first.to_host().opacity == std::vector<float>(3, 0.0f));
  CHECK(t.moments.second.to_host().opacity == std::vector<float>(3, 0.0f));
  CHECK(t.moments.first.to_host().mean == std::vector<float>(9, 1.0f));
}

TEST_CASE_TEMPLATE("a reset leaves every Gaussian above what is pruned", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  gaussian_model m = plain(3, random);
  m.opacity = {2.0f, static_cast<float>(logit(0.07)), static_cast<float>(logit(0.99))};
  adc_options options;
  options.prune_opacity = 0.06f;
  training<E> t(m, 1000, options);
  t.density.step(t, {3000});
  gaussian_model const got = t.model.to_host();
  CHECK(gart_test::sigmoid(got.opacity[0]) == doctest::Approx(0.12));
  CHECK(got.opacity[1] == m.opacity[1]);
  CHECK(gart_test::sigmoid(got.opacity[2]) == doctest::Approx(0.12));
  CHECK(t.density.densify(t, {3001}).removed == 0);

  // However much is pruned, no opacity is 1.
  options.prune_opacity = 0.6f;
  m.opacity[1] = 20;
  training<E> most(m, 1000, options);
  most.density.step(most, {3000});
  CHECK(gart_test::sigmoid(most.model.to_host().opacity[1]) == doctest::Approx(0.99));
}

TEST_CASE("what alpha_min hides counts as dead") {
  CHECK(least_opacity(0.005f, 1.0f / 255) == doctest::Approx(0.005f));
  CHECK(least_opacity(0.005f, 1e-6f) == 0.005f);
  CHECK(least_opacity(0.005f, 0.05f) == doctest::Approx(0.06375f));
}

TEST_CASE_TEMPLATE("all may go, and none may be there", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  gaussian_model m = plain(100, random);
  std::fill(m.opacity.begin(), m.opacity.end(), NAN);
  training<E> t(m);
  CHECK(t.density.densify(t, {600}).removed == 100);
  CHECK(t.model.size() == 0);
  CHECK(t.moments.first.size() == 0);
  CHECK(!t.density.step(t, {3000}).any());
  t.density.observe(t.model, t.model, camera{});
  CHECK(!t.density.due(500));
  CHECK(t.density.due(14900));
  CHECK(!t.density.due(15000));
}
