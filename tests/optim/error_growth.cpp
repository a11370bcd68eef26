// Densification by error, and the split along the long axis.
#include <support/policies.hpp>

#include <gart/train/densify/error_growth.hpp>

#include "models.hpp"

#include <algorithm>
#include <set>

using namespace gart;
using gart_test::logit;
using gart_test::sigmoid;

namespace {

error_growth_options usual() {
  error_growth_options options;
  options.split.offset = 0.4f;
  return options;
}

template <class E>
struct training : gart_test::with_moments<E> {
  using gart_test::with_moments<E>::with_moments;
  error_growth<E> densifier(index_t most, std::vector<float> const& error, u64 seed = 1, bool by_root = false) {
    error_growth_options options = usual();
    options.draw_by_root = by_root;
    error_growth<E> out(this->exec, options, most, 2000, seed);
    out.error_sum.assign(error);
    return out;
  }
};

// Each row's second colour coefficient is its number: children carry their source's.
gaussian_model tagged(index_t n, std::mt19937_64& random) {
  gaussian_model m = gart_test::random_model(n, 1, random);
  for (index_t i = 0; i < n; ++i) m.sh[std::size_t{12} * i + 1] = static_cast<float>(i);
  return m;
}
index_t tag_of(gaussian_model const& m, index_t i) { return static_cast<index_t>(m.sh[std::size_t{12} * i + 1]); }

}  // namespace

TEST_CASE("children end where their parent ended, as thick as it was") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::uniform_real_distribution<float> uniform(-1, 1);
  for (int i = 0; i < 200; ++i) {
    split_shape const shape{i % 3 == 0 ? 0.4f : i % 3 == 1 ? 0.35f : 0.25f, i % 2 ? 0.5f : 0.6f};
    vec3 const log_scale(3 * uniform(random), 3 * uniform(random), 3 * uniform(random));
    quaternion const q{uniform(random), uniform(random), uniform(random), uniform(random)};
    split_child const child = split_long_axis(shape, log_scale, q, 0.5f);
    double const norm = std::sqrt(double{q.w} * q.w + double{q.x} * q.x + double{q.y} * q.y + double{q.z} * q.z);
    if (norm < 1e-2) continue;
    // The offset in the body's axes, by q^-1 v q.
    double const w = q.w / norm, u[3] = {-q.x / norm, -q.y / norm, -q.z / norm};
    double const v[3] = {child.offset.x, child.offset.y, child.offset.z};
    double const t[3] = {2 * (u[1] * v[2] - u[2] * v[1]), 2 * (u[2] * v[0] - u[0] * v[2]),
                         2 * (u[0] * v[1] - u[1] * v[0])};
    double const body[3] = {v[0] + w * t[0] + u[1] * t[2] - u[2] * t[1], v[1] + w * t[1] + u[2] * t[0] - u[0] * t[2],
                            v[2] + w * t[2] + u[0] * t[1] - u[1] * t[0]};
    int longest = 0;
    for (int k = 1; k < 3; ++k)
      if (log_scale[k] > log_scale[longest]) longest = k;
    double const reach = 3 * std::exp(double{log_scale[longest]});
    double worst = 0;  // the largest |p|^2 of the child's surface at 3 standard deviations, in the old one's
    for (int k = 0; k < 3; ++k) {
      if (k != longest) CHECK(std::abs(body[k]) < 1e-5 * reach);
      CHECK(child.log_scale[k] < log_scale[k]);
    }
    for (double a = 0; a <= 3.1416; a += 0.01) {
      double const along = std::abs(body[longest]) + std::cos(a) * 3 * std::exp(double{child.log_scale[longest]});
      int const other = (longest + 1) % 3;
      double const across = std::sin(a) * 3 * std::exp(double{child.log_scale[other]} - log_scale[other]);
      worst = std::max(worst, along * along / (reach * reach) * 9 + across * across);
    }
    CHECK(std::abs(body[longest]) + 3 * std::exp(double{child.log_scale[longest]}) ==
          doctest::Approx(reach).epsilon(1e-4));
    CHECK(worst < 9 * 1.06 * 1.06 * 1.001);
    double const q3 = std::abs(body[longest]) / reach;
    for (int k = 0; k < 3; ++k)
      if (k != longest)
        CHECK(std::exp(double{child.log_scale[k]} - log_scale[k]) ==
              doctest::Approx(std::sqrt(1 - q3 * q3)).epsilon(1e-4));
    CHECK(q3 == doctest::Approx(double{shape.offset}).epsilon(1e-4));
    CHECK(child.opacity == doctest::Approx(0.5 * double{shape.opacity}));
  }
}

TEST_CASE_TEMPLATE("dead Gaussians give rows to children by the error seen", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  index_t const n = 2000, most = 2300;
  gaussian_model start = tagged(n, random);
  std::vector<float> error(n);
  std::set<index_t> dead, blind;
  for (index_t i = 0; i < n; ++i) {
    error[i] = 0.1f + static_cast<float>(random() % 100);
    if (random() % 6 == 0)
      start.opacity[i] = logit(0.006), error[i] *= 50;  // a child's would be less than a dead one's
    if (random() % 8 == 0) start.opacity[i] = -6, dead.insert(i);
    if (random() % 4 == 0) error[i] = 0, blind.insert(i);
  }
  start.opacity[3] = NAN, start.mean[3 * 4] = INFINITY, start.log_scale[3 * 5 + 1] = NAN;
  for (index_t i : {3, 4, 5}) dead.insert(i);
  error[6] = INFINITY, error[7] = NAN, error[8] = -1;
  for (index_t i : {6, 7, 8}) blind.insert(i);

  training<E> t(start);
  auto densifier = t.densifier(most, error);
  density_change const change = densifier.densify(t, {1500});  // the count is full by then
  CHECK(change.relocated == dead.size());
  CHECK(change.added == most - n);
  gaussian_model got = t.model.to_host(), first = t.moments.first.to_host(), second = t.moments.second.to_host();
  REQUIRE(got.size() == most);
  REQUIRE(first.size() == most);

  std::set<index_t> split;
  for (index_t i = 0; i < most; ++i) {
    bool const taken = i >= n || dead.count(i);
    REQUIRE(gart_test::all_zero(gart_test::row(first, i)) == taken);
    REQUIRE(gart_test::all_zero(gart_test::row(second, i)) == taken);
    if (!taken) {
      REQUIRE(tag_of(got, i) == i);
      continue;
    }
    index_t const source = tag_of(got, i);
    REQUIRE(source < n);
    CHECK(!dead.count(source));
    CHECK(!blind.count(source));
    CHECK(split.insert(source).second);  // once each
    double middle = 0, scale = 0;
    for (int k = 0; k < 3; ++k) {
      CHECK(got.log_scale[3 * i + k] == got.log_scale[3 * source + k]);
      double const m = 0.5 * (double{got.mean[3 * i + k]} + got.mean[3 * source + k]) - start.mean[3 * source + k];
      middle += m * m, scale = std::max(scale, std::exp(double{start.log_scale[3 * source + k]}));
    }
    CHECK(std::sqrt(middle) < 1e-5 * (1 + scale));
    CHECK(sigmoid(got.opacity[i]) ==
          doctest::Approx(std::max(0.6 * sigmoid(start.opacity[source]), 1.01 * 0.005)).epsilon(1e-4));
    CHECK(got.opacity[i] == got.opacity[source]);
  }
  for (index_t i = 0; i < n; ++i)
    if (!dead.count(i) && !split.count(i)) REQUIRE(gart_test::row(got, i) == gart_test::row(start, i));
  for (float const e : densifier.error_sum.to_host()) REQUIRE(e == 0);
  CHECK(densifier.error_sum.size() == most);
}

// Whether rows are drawn in proportion to opacity times error, or times its root.
template <class E>
void check_draws(bool by_root) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  index_t const n = 40000, drawn = 800;
  int const kinds = 8;
  auto const error_of = [](index_t kind) { return 1.0 + 3 * (kind % 4); };
  auto const weight_of = [&](index_t kind) { return by_root ? std::sqrt(error_of(kind)) : error_of(kind); };
  auto const opacity_of = [](index_t kind) { return kind < 4 ? 0.2 : 0.8; };
  gaussian_model start = tagged(n, random);
  std::vector<float> error(n);
  for (index_t i = 0; i < n; ++i) {
    error[i] = static_cast<float>(error_of(i % kinds));
    start.opacity[i] = static_cast<float>(logit(opacity_of(i % kinds)));
  }
  training<E> t(start);
  auto densifier = t.densifier(n + drawn, error, gart_test::seed(), by_root);
  REQUIRE(densifier.densify(t, {1500}).added == drawn);
  gaussian_model const got = t.model.to_host();
  double count[kinds] = {}, chi_square = 0, all = 0;
  for (index_t i = n; i < n + drawn; ++i) ++count[tag_of(got, i) % kinds];
  for (index_t k = 0; k < kinds; ++k) all += weight_of(k) * opacity_of(k);
  for (index_t k = 0; k < kinds; ++k) {
    double const expected = drawn * weight_of(k) * opacity_of(k) / all, d = count[k] - expected;
    chi_square += d * d / expected;
  }
  CHECK(chi_square < 33);  // of seven degrees of freedom: one run in 40,000
}

TEST_CASE_TEMPLATE("sources are drawn by error and opacity", E, GART_TEST_POLICIES) { check_draws<E>(false); }
TEST_CASE_TEMPLATE("sources are drawn by the root of the error", E, GART_TEST_POLICIES) { check_draws<E>(true); }

TEST_CASE_TEMPLATE("the count follows its curve and at most doubles", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(gart_test::seed());
  E exec;
  error_growth<E> const plan(exec, usual(), 10000, 2000, 1);
  CHECK(!plan.due(500));
  CHECK(plan.due(600));
  CHECK(!plan.due(601));
  CHECK(!plan.due(1700));
  CHECK(plan.budget_at(500) == 0);
  CHECK(plan.budget_at(625) == 5000);
  CHECK(plan.budget_at(1000) == 10000);
  CHECK(plan.budget_at(1600) == 10000);

  training<E> t(tagged(300, random));
  auto densifier = t.densifier(10000, std::vector<float>(300, 1.0f));
  CHECK(densifier.densify(t, {700}).added == 300);
  REQUIRE(t.model.size() == 600);
  CHECK(!densifier.densify(t, {800}).any());  // no error has been seen since
}

TEST_CASE_TEMPLATE("nothing to draw from", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  for (float const opacity : {-200.0f, NAN, INFINITY}) {
    gaussian_model start = tagged(100, random);
    std::fill(start.opacity.begin(), start.opacity.end(), opacity);
    training<E> t(start);
    auto densifier = t.densifier(200, std::vector<float>(100, 1.0f));
    CHECK(!densifier.densify(t, {600}).any());
    CHECK(t.model.size() == 100);
  }
  gaussian_model none;
  none.resize(0, 0);
  training<E> t(none);
  auto densifier = t.densifier(200, {});
  CHECK(!densifier.step(t, {600}).any());
  densifier.penalty(t, 0);
}

TEST_CASE_TEMPLATE("the statistic adds up steps; the penalty is mean opacity's", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  index_t const n = 50;
  gaussian_model const m = gart_test::random_model(n, 0, random), g = gart_test::random_model(n, 0, random);
  training<E> t(m);
  t.gradients.assign(g);
  std::vector<float> moments(std::size_t{moment_stride} * n);
  gart_test::fill(moments, random, 0, 1);
  buffer<float, E> const on_policy(t.exec, moments);
  error_growth<E> densifier(t.exec, usual(), n, 1000, 1);
  for (int i = 0; i < 3; ++i) add_errors(t.exec, on_policy, densifier.error_sums(n)), densifier.penalty(t, n);
  auto const sum = densifier.error_sum.to_host();
  gaussian_model const got = t.gradients.to_host();
  double const h = 1e-5;
  for (index_t i = 0; i < n; ++i) {
    CHECK(sum[i] == doctest::Approx(3 * moments[std::size_t{moment_stride} * i + error_place]));
    double const o = m.opacity[i];
    CHECK(std::abs(got.opacity[i] - double{g.opacity[i]} -
                   3 * 0.003 * (sigmoid(o + h) - sigmoid(o - h)) / (2 * h) / n) < 1e-6);
  }
  CHECK(got.mean == g.mean);
}

TEST_CASE_TEMPLATE("a split that leaves no children is refused by field", E, GART_TEST_POLICIES) {
  E exec;
  auto const made = [&](float share, float opacity) {
    gart::error_growth_options options;
    options.split = {share, opacity};
    gart::error_growth<E>(exec, options, 10, 10, 1);
  };
  made(0.5f, 1.0f);
  for (float const bad : {0.0f, 1.0f, -0.5f, NAN}) {
    CHECK_THROWS_WITH_AS(made(bad, 0.5f), doctest::Contains("split_shape.offset"), gart::invalid_argument);
    if (bad != 1.0f)
      CHECK_THROWS_WITH_AS(made(0.5f, bad), doctest::Contains("split_shape.opacity"), gart::invalid_argument);
  }
}

TEST_CASE("growth ends where the capture has too few pixels for more") {
  gart::error_growth_options options;
  auto const budget = [&](gart::index_t most, gart::u64 pixels) { return gart::growth_budget(options, most, pixels); };
  CHECK(budget(1'000'000, 22'809'600) == 114'048);     // 44 photographs of 540 x 960
  CHECK(budget(1'000'000, 217'464'000) == 1'000'000);  // 510 of 800 x 533
  CHECK(budget(1'000'000, 912'384) == 100'000);        // no capture is too small for so many
  CHECK(budget(20'000, 912'384) == 20'000);
  options.min_gaussians = 0;
  CHECK(budget(1'000'000, 912'384) == 4'561);
  CHECK(budget(1'000'000, 0) == 0);
  options.pixels_per_gaussian = 0;
  CHECK(budget(1'000'000, 912'384) == 1'000'000);
}

TEST_CASE("children are nearer where the capture has pixels for them") {
  gart::error_growth_options options;
  auto const share = [&](gart::index_t most, gart::u64 pixels) { return gart::split_offset(options, most, pixels); };
  CHECK(share(1'000'000, 22'809'600) == 0.4f);
  CHECK(share(114'049, 22'809'600) == 0.4f);
  CHECK(share(114'048, 22'809'600) == 0.35f);
  CHECK(share(1'000'000, 217'464'000) == 0.35f);
  options.pixels_per_gaussian = 0;
  CHECK(share(1'000'000, 22'809'600) == 0.35f);
  options.pixels_per_gaussian = 200, options.split.offset = 0.25f;
  CHECK(share(1'000'000, 22'809'600) == 0.25f);
}
