#include <support/policies.hpp>

#include <gart/train/densify/mcmc.hpp>

#include "models.hpp"

#include <algorithm>

using namespace gart;
using gart_test::logit;
using gart_test::sigmoid;

namespace {

// Second moments of means and scales are the number of the row.
template <class E>
struct training : gart_test::with_moments<E> {
  explicit training(gaussian_model const& m) : gart_test::with_moments<E>(m) {
    gaussian_model numbers = this->ones_like(m);
    for (std::size_t i = 0; i < m.size(); ++i)
      for (int c = 0; c < 3; ++c) numbers.mean[3 * i + c] = numbers.log_scale[3 * i + c] = static_cast<float>(i + 1);
    this->moments.second.assign(numbers);
  }
  mcmc<E> densifier(index_t most, float growth = 1.05f, u64 seed = 1, int iterations = 1000) {
    mcmc_options options;
    options.growth = growth;
    return {this->exec, options, most, iterations, 1.0f, seed};
  }
};

// The tag of a row: its first colour coefficient, which copies carry.
void tag(gaussian_model& m) {
  for (std::size_t i = 0; i < m.size(); ++i) m.sh[i * 3 * sh_coefficients(m.sh_degree)] = static_cast<float>(i);
}
std::size_t tag_of(gaussian_model const& m, std::size_t i) {
  return static_cast<std::size_t>(m.sh[i * 3 * sh_coefficients(m.sh_degree)]);
}

}  // namespace

TEST_CASE("relocated copies render what their source did") {
  for (int const degree : {1, 2, 4, 8}) {
    auto const response = [degree](double x) { return std::exp(-4.5 * std::pow(std::abs(x) / 3, degree)); };
    for (double const o : {0.006, 0.1, 0.5, 0.9, 0.99, 0.9999})
      for (u32 const n : {1u, 2u, 3u, 10u, 51u}) {
        CAPTURE(degree);
        CAPTURE(o);
        CAPTURE(n);
        relocated_shape const s = relocation(o, n, degree);
        CHECK(1 - std::pow(1 - s.opacity, n) == doctest::Approx(o).epsilon(1e-10));
        // The integral across a line through the centre, before and after.
        double before = 0, after = 0;
        for (double x = -40; x <= 40; x += 1e-3) {
          before += o * response(x) * 1e-3;
          after += (1 - std::pow(1 - s.opacity * response(x / s.scale_factor), n)) * 1e-3;
        }
        CHECK(after == doctest::Approx(before).epsilon(2e-6));
      }
  }
  CHECK(relocation(0.7, 1000).opacity == relocation(0.7, 51).opacity);
}

TEST_CASE_TEMPLATE("every dead Gaussian moves onto a live one and shares it", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  index_t const n = 3000;
  gaussian_model start = gart_test::random_model(n, 1, random);
  std::vector<bool> dead(n);
  for (index_t i = 0; i < n; ++i)
    if (random() % 3 == 0) dead[i] = true, start.opacity[i] = -6;
  tag(start);
  start.opacity[10] = NAN, start.mean[3 * 11 + 1] = NAN, start.log_scale[3 * 12] = INFINITY;
  start.opacity[13] = -INFINITY;
  for (int i = 10; i < 14; ++i) dead[i] = true;

  {
    training<E> t(start);
    auto densifier = t.densifier(n);
    density_change const change = densifier.densify(t, {600});
    CHECK(change.relocated == static_cast<index_t>(std::count(dead.begin(), dead.end(), true)));
    CHECK(change.added == 0);
    gaussian_model got = t.model.to_host(), first = t.moments.first.to_host(), second = t.moments.second.to_host();
    REQUIRE(got.size() == n);

    std::vector<u32> copies(n);
    for (index_t i = 0; i < n; ++i)
      if (dead[i]) {
        REQUIRE(tag_of(got, i) < n);
        REQUIRE(!dead[tag_of(got, i)]);
        ++copies[tag_of(got, i)];
      } else {
        REQUIRE(tag_of(got, i) == i);
      }
    for (index_t i = 0; i < n; ++i) {
      auto const row = gart_test::row(got, i);
      index_t const source = static_cast<index_t>(tag_of(got, i));
      bool const moved = copies[source] > 0;
      REQUIRE(row == gart_test::row(got, source));
      // Sources start anew, what moves keeps the moments of its row.
      bool const cleared = moved && source == i;
      REQUIRE(gart_test::all_zero(gart_test::row(first, i)) == cleared);
      auto const square = gart_test::row(second, i);
      for (std::size_t c = 0; c < square.size(); ++c)
        REQUIRE(square[c] == (cleared ? 0.0f : c < 6 ? static_cast<float>(i + 1) : 1.0f));
      auto expected = gart_test::row(start, source);
      if (moved) {
        relocated_shape const s = relocation(sigmoid(expected[10]), copies[source] + 1);
        REQUIRE(sigmoid(row[10]) == doctest::Approx(std::max(s.opacity, 0.005)).epsilon(1e-5));
        for (int c = 3; c < 6; ++c) {
          REQUIRE(row[c] == doctest::Approx(expected[c] + std::log(s.scale_factor)).epsilon(1e-5));
          expected[c] = row[c];
        }
        expected[10] = row[10];
      }
      REQUIRE(row == expected);
    }
  }
}

TEST_CASE_TEMPLATE("sources are drawn in proportion to opacity", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  double const opacity[] = {0.02, 0.1, 0.3, 0.6, 0.95, 0.05, 0.5};
  index_t const alive = 7, n = 50000;
  gaussian_model start = gart_test::random_model(n, 0, random);
  double sum = 0;
  for (index_t i = 0; i < n; ++i) start.opacity[i] = -8;
  for (index_t k = 0; k < alive; ++k) {
    start.opacity[k * 7001] = static_cast<float>(logit(opacity[k]));
    sum += opacity[k];
  }
  tag(start);
  training<E> t(start);
  auto densifier = t.densifier(n, 1.05f, gart_test::seed());
  CHECK(densifier.densify(t, {600}).relocated == n - alive);
  gaussian_model const got = t.model.to_host();
  std::vector<double> count(alive);
  for (index_t i = 0; i < n; ++i) {
    REQUIRE(tag_of(got, i) % 7001 == 0);
    ++count[tag_of(got, i) / 7001];
  }
  double chi_square = 0;
  for (index_t k = 0; k < alive; ++k) {
    double const expected = (n - alive) * opacity[k] / sum, d = count[k] - 1 - expected;
    chi_square += d * d / expected;
  }
  CHECK(chi_square < 38);  // 6 degrees of freedom: one run in a million
}

TEST_CASE_TEMPLATE("more than 2^24 Gaussians can be drawn from", E, GART_TEST_POLICIES) {
  E exec;
  std::size_t const n = (std::size_t{1} << 25) + 3;
  index_t const draws = 4000;
  std::vector<u32> weights(n, 3);
  buffer<u32, E> weight(exec, weights), source(exec, draws), copies(exec, n);
  buffer<u64, E> before(exec, n), total(exec, 1);
  copies.zero();
  exclusive_scan(exec, span<u32 const>(weight), before.view(), total.view());
  parallel_for(exec, "draw", draws,
               detail::mcmc_draw_kernel<E>{before.data(),
                                           total.data(),
                                           static_cast<index_t>(n),
                                           {5, 1, random_use::user},
                                           source.data(),
                                           copies.data()});
  int high_odd = 0, high_even = 0;
  random_source const random{5, 1, random_use::user};
  auto const drawn = source.to_host();
  for (index_t i = 0; i < draws; ++i) {
    auto const w = random.words(i);
    u64 const at = static_cast<u64>((static_cast<unsigned __int128>(u64{w.v[0]} << 32 | w.v[1]) * (3 * n)) >> 64);
    REQUIRE(drawn[i] == at / 3);
    if (drawn[i] > 1u << 24) ++(drawn[i] % 2 ? high_odd : high_even);
  }
  CHECK(high_odd > 800);
  CHECK(high_even > 800);
}

TEST_CASE_TEMPLATE("growth reaches the budget exactly and stops", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  gaussian_model start = gart_test::random_model(1000, 1, random);
  tag(start);
  training<E> t(start);
  auto densifier = t.densifier(1100);
  CHECK(densifier.densify(t, {600}).added == 50);
  gaussian_model got = t.model.to_host(), first = t.moments.first.to_host();
  REQUIRE(got.size() == 1050);
  REQUIRE(t.moments.second.size() == 1050);
  for (index_t i = 0; i < 1050; ++i) {
    REQUIRE(gart_test::row(got, i) == gart_test::row(got, static_cast<index_t>(tag_of(got, i))));
    REQUIRE(gart_test::all_zero(gart_test::row(first, i)) == (i >= 1000));
  }
  CHECK(densifier.densify(t, {700}).added == 50);
  CHECK(t.model.size() == 1100);
  CHECK(!densifier.densify(t, {800}).any());
  CHECK(t.model.size() == 1100);

  training<E> one(gart_test::random_model(1, 0, random));
  auto small = one.densifier(5);
  for (int i = 0; i < 6; ++i) small.densify(one, {600 + i});
  CHECK(one.model.size() == 5);
}

TEST_CASE_TEMPLATE("nothing alive, nothing at all, weights that are no numbers", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  for (float const opacity : {-200.0f, NAN, INFINITY}) {
    gaussian_model start = gart_test::random_model(100, 0, random);
    std::fill(start.opacity.begin(), start.opacity.end(), opacity);
    training<E> t(start);
    auto densifier = t.densifier(200);
    CHECK(!densifier.densify(t, {600}).any());
    CHECK(t.model.size() == 100);
  }
  gaussian_model none;
  none.resize(0, 0);
  training<E> t(none);
  auto densifier = t.densifier(200);
  CHECK(!densifier.step(t, {600, 1e-4f}).any());
  densifier.penalty(t, 0);
}

TEST_CASE_TEMPLATE("densification runs between its limits", E, GART_TEST_POLICIES) {
  E exec;
  mcmc<E> const densifier(exec, {}, 10, 1200, 1.0f, 1);
  CHECK(!densifier.due(500));
  CHECK(densifier.due(600));
  CHECK(!densifier.due(601));
  CHECK(densifier.due(900));
  CHECK(!densifier.due(1000));
}

TEST_CASE_TEMPLATE("noise has the squared covariance and spares the opaque", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  index_t const n = 40000;
  gaussian_model start = gart_test::random_model(n, 0, random);
  double const scale[3] = {0.5, 0.2, 0.05}, q[4] = {0.3, -0.8, 0.5, 0.4};  // not of unit length
  for (index_t i = 0; i < n; ++i) {
    for (int c = 0; c < 3; ++c) start.log_scale[3 * i + c] = static_cast<float>(std::log(scale[c]));
    for (int c = 0; c < 4; ++c) start.quaternion[4 * i + c] = static_cast<float>(q[c]);
    start.opacity[i] = i % 2 ? 6.0f : static_cast<float>(logit(0.005));
  }
  training<E> t(start);
  // Times 1e6, over the square of the extent: 1, and half of it where the gate is at its middle.
  float const extent = 4, rate = 16e-6f;
  mcmc<E>(t.exec, {}, n, 1000, extent, 1).add_noise(t.model, 7, rate);
  gaussian_model const got = t.model.to_host();

  // The covariance by rotating the axes with q v q^-1.
  double norm = 0, sigma[3][3] = {}, expected[3][3] = {}, sampled[3][3] = {};
  for (double const v : q) norm += v * v;
  for (int k = 0; k < 3; ++k) {
    double v[3] = {}, axis[3];
    v[k] = scale[k];
    double const dot = (q[1] * v[0] + q[2] * v[1] + q[3] * v[2]) / norm,
                 ww = (q[0] * q[0] - (norm - q[0] * q[0])) / norm, w2 = 2 * q[0] / norm;
    double const cross[3] = {q[2] * v[2] - q[3] * v[1], q[3] * v[0] - q[1] * v[2], q[1] * v[1] - q[2] * v[0]};
    for (int c = 0; c < 3; ++c) axis[c] = ww * v[c] + 2 * dot * q[c + 1] + w2 * cross[c];
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) sigma[a][b] += axis[a] * axis[b];
  }
  double largest = 0;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      for (int k = 0; k < 3; ++k) expected[a][b] += 0.25 * sigma[a][k] * sigma[k][b];
      largest = std::max(largest, std::abs(expected[a][b]));
    }
  for (index_t i = 0; i < n; ++i) {
    double d[3];
    for (int c = 0; c < 3; ++c) d[c] = static_cast<double>(got.mean[3 * i + c]) - start.mean[3 * i + c];
    if (i % 2) {
      REQUIRE(std::abs(d[0]) + std::abs(d[1]) + std::abs(d[2]) < 1e-6);
      continue;
    }
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) sampled[a][b] += d[a] * d[b] / (n / 2);
  }
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) CHECK(std::abs(sampled[a][b] - expected[a][b]) < 0.06 * largest);
  CHECK(got.opacity == start.opacity);
}

TEST_CASE_TEMPLATE("noise moves what counts as dead, wherever that begins", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  index_t const n = 300;
  gaussian_model const start = gart_test::random_model(n, 0, random);
  // How far each coordinate moves with opacities of `opacity`, where `dead` counts as dead.
  auto const moves = [&](double opacity, float dead) {
    gaussian_model m = start;
    std::fill(m.opacity.begin(), m.opacity.end(), static_cast<float>(logit(opacity)));
    std::fill(m.mean.begin(), m.mean.end(), 0.0f);
    training<E> t(m);
    mcmc_options options;
    options.dead_opacity = dead;
    mcmc<E>(t.exec, options, n, 1000, 1.0f, 1).add_noise(t.model, 7, 1e-6f);
    return t.model.to_host().mean;
  };
  auto const at_usual = moves(0.005, 0.005f), at_raised = moves(0.2, 0.2f), below = moves(0.005, 0.2f),
             above = moves(0.2, 0.005f);
  for (std::size_t i = 0; i < at_usual.size(); ++i) {
    CHECK(at_raised[i] == doctest::Approx(at_usual[i]).epsilon(1e-4).scale(0));
    CHECK(below[i] == doctest::Approx(2 * at_usual[i]).epsilon(1e-4).scale(0));
    CHECK(std::abs(above[i]) <= 1e-6f * std::abs(at_usual[i]));
  }
}

TEST_CASE_TEMPLATE("noise leaves the mean of a broken Gaussian finite", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(1);
  gaussian_model start = gart_test::random_model(3, 0, random);
  std::fill(start.opacity.begin(), start.opacity.end(), -5.0f);
  start.log_scale[0] = 80, start.quaternion[4] = start.quaternion[5] = start.quaternion[6] = start.quaternion[7] = 0;
  start.opacity[2] = NAN;
  training<E> t(start);
  auto densifier = t.densifier(3);
  densifier.add_noise(t.model, 1, 1e-4f);
  CHECK(t.model.to_host().mean == start.mean);
}

TEST_CASE_TEMPLATE("penalties add their own gradient", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  index_t const n = 40;
  gaussian_model const m = gart_test::random_model(n, 0, random), g = gart_test::random_model(n, 0, random);
  training<E> t(m);
  t.gradients.assign(g);
  double const extent = 2;
  mcmc<E>(t.exec, {}, n, 1000, static_cast<float>(extent), 1).penalty(t, n);
  gaussian_model const got = t.gradients.to_host();
  double const h = 1e-5;
  for (index_t i = 0; i < n; ++i) {
    double const o = m.opacity[i];
    CHECK(got.opacity[i] - static_cast<double>(g.opacity[i]) ==
          doctest::Approx(0.01 * (sigmoid(o + h) - sigmoid(o - h)) / (2 * h) / n).epsilon(1e-2));
  }
  for (index_t i = 0; i < 3 * n; ++i) {
    double const s = m.log_scale[i];
    CHECK(std::abs(got.log_scale[i] - static_cast<double>(g.log_scale[i]) -
                   0.014 / extent * (std::exp(s + h) - std::exp(s - h)) / (2 * h) / (3 * n)) < 3e-7);
  }
  CHECK(got.mean == g.mean);
}

TEST_CASE_TEMPLATE("the same seed and step give the same model", E, GART_TEST_POLICIES) {
  std::mt19937_64 random(3);
  gaussian_model const start = gart_test::random_model(2000, 1, random);
  gaussian_model results[3];
  for (int i = 0; i < 3; ++i) {
    training<E> t(start);
    auto densifier = t.densifier(2500, 1.05f, i < 2 ? 9 : 10);
    densifier.step(t, {600, 1e-4f});
    results[i] = t.model.to_host();
  }
  CHECK(results[0].mean == results[1].mean);
  CHECK(results[0].sh == results[1].sh);
  CHECK(results[0].sh != results[2].sh);
}
