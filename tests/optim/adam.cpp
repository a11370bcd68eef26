#include <support/policies.hpp>

#include <gart/optim/adam.hpp>

#include "models.hpp"

#include <algorithm>
#include <type_traits>

using namespace gart;

namespace {

// The textbook's Adam of one element, in double.
struct textbook {
  double m = 0, v = 0;
  double step(double p, double g, double rate, int t) {
    double const b1 = 0.9f, b2 = 0.999f;
    m = b1 * m + (1 - b1) * g;
    v = b2 * v + (1 - b2) * g * g;
    return p - rate * (m / (1 - std::pow(b1, t))) / (std::sqrt(v / (1 - std::pow(b2, t))) + 1e-15);
  }
};

// What a kernel that sums gradients does: gives them piece by piece, of one float or of four.
struct single {
  float v[1];
};
template <index_t Width, class Take>
struct give_colors {
  float const* gradient;
  index_t floats;
  Take take;
  GART_KERNEL void operator()(index_t row, index_t column) const {
    std::conditional_t<Width == 4, quad, single> piece;
    for (index_t c = 0; c < Width; ++c) piece.v[c] = gradient[row * floats + Width * column + c];
    take(row, Width * column, piece);
  }
};

}  // namespace

TEST_CASE_TEMPLATE("Adam follows the textbook, with a rate per group", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  index_t const n = 517;
  int const degree = 2;
  gaussian_model start = gart_test::random_model(n, degree, random);
  gaussians<E> model(exec, start);
  optimizer_state<E> state(exec, n, degree);
  learning_rates rates;
  rates.mean = 1e-3f;
  index_t const width = row_width(degree);
  std::vector<textbook> oracle(n * width);
  std::vector<double> expected(n * width);
  for (index_t i = 0; i < n; ++i)
    for (index_t c = 0; c < width; ++c) expected[i * width + c] = gart_test::row(start, i)[c];

  for (int step = 1; step <= 6; ++step) {
    int const active = step <= 3 ? 1 : 2;
    gaussian_model g = gart_test::random_model(n, degree, random);
    for (float& v : g.mean) v *= 1e-6f;
    gaussians<E> const gradient(exec, g);
    adam_step(exec, model, gradient, state, rates, step, active);
    for (index_t i = 0; i < n; ++i) {
      auto const row = gart_test::row(g, i);
      for (index_t c = 0; c < width; ++c) {
        if (c >= 11 + 3u * sh_coefficients(active)) continue;
        double const rate = c < 3    ? rates.mean
                            : c < 6  ? rates.log_scale
                            : c < 10 ? rates.quaternion
                            : c < 11 ? rates.opacity
                            : c < 14 ? rates.sh_dc
                                     : rates.sh_rest;
        auto const at = i * width + c;
        expected[at] = oracle[at].step(expected[at], row[c], rate, step);
      }
    }
  }
  gaussian_model got = model.to_host();
  double worst = 0;
  for (index_t i = 0; i < n; ++i)
    for (index_t c = 0; c < width; ++c)
      worst = std::max(worst, std::abs(gart_test::row(got, i)[c] - expected[i * width + c]));
  CHECK(worst < 2e-6);  // values up to 4, six roundings
}

TEST_CASE_TEMPLATE("bands above the first are pulled where they have a gradient", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  index_t const n = 203;
  int const degree = 2;
  gaussian_model const start = gart_test::random_model(n, degree, random);
  gaussian_model g = gart_test::random_model(n, degree, random);
  index_t const width = 3 * sh_coefficients(degree);
  for (std::size_t i = 0; i < g.sh.size(); ++i)
    if (i / width % 3 == 0 || i % 5 == 0) g.sh[i] = 0;
  gaussian_model pulled = g;
  adam_options options;
  options.sh_pull = 0.25f;
  for (std::size_t i = 0; i < g.sh.size(); ++i)
    if (i % width >= 3 && g.sh[i] != 0) pulled.sh[i] = std::fma(options.sh_pull, start.sh[i], g.sh[i]);
  auto const moved = [&](gaussian_model const& slope, adam_options const& with) {
    gaussians<E> model(exec, start);
    optimizer_state<E> state(exec, n, degree);
    adam_step(exec, model, gaussians<E>(exec, slope), state, learning_rates{}, 1, degree, {}, with);
    return model.to_host();
  };
  gaussian_model const by_pull = moved(g, options), by_gradient = moved(pulled, {}), without = moved(g, {});
  CHECK(by_pull.sh == by_gradient.sh);
  CHECK(by_pull.sh != without.sh);
  CHECK(by_pull.mean == without.mean);
  CHECK(by_pull.opacity == without.opacity);
}

TEST_CASE_TEMPLATE("elements whose gradient is not finite stay, and are counted", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  gaussian_model const start = gart_test::random_model(300, 0, random);
  gaussian_model g = gart_test::random_model(300, 0, random);
  g.mean[5] = NAN, g.opacity[299] = INFINITY, g.sh[17] = 3e30f;  // the last squares to infinity
  gaussians<E> model(exec, start);
  gaussians<E> const gradient(exec, g);
  optimizer_state<E> state(exec, 300, 0);
  buffer<u64, E> skipped(exec, std::vector<u64>{0});
  adam_step(exec, model, gradient, state, {}, 1, 0, skipped.view());
  adam_step(exec, model, gradient, state, {}, 2, 0);
  gaussian_model const got = model.to_host(), first = state.first.to_host(), second = state.second.to_host();
  CHECK(skipped.front() == 3);
  CHECK(got.mean[5] == start.mean[5]);
  CHECK(got.opacity[299] == start.opacity[299]);
  CHECK(got.sh[17] == start.sh[17]);
  CHECK(first.mean[5] == 0);
  CHECK(second.sh[17] == 0);
  CHECK(got.mean[4] != start.mean[4]);
  CHECK(got.opacity[298] != start.opacity[298]);
}

TEST_CASE_TEMPLATE("sparse steps leave unseen rows and move all others", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  index_t const n = 700;
  for (int const degree : {0, 3}) {
    CAPTURE(degree);
    gaussian_model start = gart_test::random_model(n, degree, random);
    gaussian_model g = gart_test::random_model(n, degree, random);
    std::vector<bool> seen(n);
    for (index_t i = 0; i < n; ++i) {
      seen[i] = i > 0 && random() % 4 > 0 ? seen[i - 1] : random() % 2;  // in runs
      if (seen[i] && random() % 8 > 0) continue;
      // Penalties leave a gradient of opacity and size where there is no other; one number of three is enough.
      float const kept = g.mean[3 * i + 1];
      std::fill_n(&g.mean[3 * i], 3, 0.0f);
      if (seen[i]) g.mean[3 * i + random() % 3] = kept;
    }
    gaussians<E> const gradient(exec, g);
    gaussians<E> all(exec, start), some(exec, start);
    optimizer_state<E> state_of_all(exec, n, degree), state_of_some(exec, n, degree);
    adam_options options;
    options.sparse = true;
    for (int step = 1; step <= 3; ++step) {
      adam_step(exec, all, gradient, state_of_all, {}, step, degree);
      adam_step(exec, some, gradient, state_of_some, {}, step, degree, {}, options);
    }
    gaussian_model moved = all.to_host(), got = some.to_host();
    gaussian_model first = state_of_all.first.to_host(), got_first = state_of_some.first.to_host();
    gaussian_model second = state_of_all.second.to_host(), got_second = state_of_some.second.to_host();
    std::vector<float> const zeros(row_width(degree));
    for (index_t i = 0; i < n; ++i) {
      CAPTURE(i);
      CHECK(gart_test::row(got, i) == gart_test::row(seen[i] ? moved : start, i));
      CHECK(gart_test::row(got_first, i) == (seen[i] ? gart_test::row(first, i) : zeros));
      CHECK(gart_test::row(got_second, i) == (seen[i] ? gart_test::row(second, i) : zeros));
    }
  }
}

TEST_CASE_TEMPLATE("Adam in two launches has the bits of one", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  index_t const n = 391;
  for (int const degree : {0, 2, 3}) {
    for (bool const sparse : {false, true}) {
      CAPTURE(degree);
      CAPTURE(sparse);
      gaussian_model const start = gart_test::random_model(n, degree, random);
      gaussian_model g = gart_test::random_model(n, degree, random);
      for (index_t i = 0; i < n; ++i)
        if (random() % 3 == 0) std::fill_n(&g.mean[3 * i], 3, 0.0f);
      index_t const floats = 3 * sh_coefficients(degree);
      g.sh[floats * 7] = NAN;
      buffer<float, E> const given(exec, g.sh);
      gaussians<E> const whole(exec, g);
      std::fill(g.sh.begin(), g.sh.end(), 1.0f);  // not to be read
      gaussians<E> const without(exec, g);
      gaussians<E> one(exec, start), two(exec, start);
      optimizer_state<E> state_of_one(exec, n, degree), state_of_two(exec, n, degree);
      buffer<u64, E> skipped(exec, std::vector<u64>{0, 0});
      adam_options options;
      options.sparse = sparse;
      for (int step = 1; step <= 3; ++step) {
        int const active = std::min(degree, step - 1);
        adam_step(exec, one, whole, state_of_one, {}, step, active, skipped.view().subspan(0, 1), options);
        adam_pass<E> const pass(two, without, state_of_two, {}, step, active, skipped.view().subspan(1, 1), options);
        pass.geometry(exec);
        pass.colors([&]<class Take>(Take const& take) {
          if (floats % 4 == 0)
            for_each_column(exec, "give", n, floats / 4, give_colors<4, Take>{given.data(), floats, take});
          else
            for_each_column(exec, "give", n, floats, give_colors<1, Take>{given.data(), floats, take});
        });
      }
      for (auto const& [a, b] : {std::pair(&one, &two), std::pair(&state_of_one.first, &state_of_two.first),
                                 std::pair(&state_of_one.second, &state_of_two.second)}) {
        gaussian_model x = a->to_host(), y = b->to_host();
        for (index_t i = 0; i < n; ++i) CHECK(gart_test::row(x, i) == gart_test::row(y, i));
      }
      std::vector<u64> const counts = skipped.to_host();
      CHECK(counts[0] == counts[1]);
      if (!sparse || g.mean[3 * 7] != 0) CHECK(counts[0] == 3);
    }
  }
}

TEST_CASE_TEMPLATE("Adam of nothing", E, GART_TEST_POLICIES) {
  E exec;
  gaussians<E> model(exec, 0, 3);
  gaussians<E> const gradient(exec, 0, 3);
  optimizer_state<E> state(exec, 0, 3);
  adam_step(exec, model, gradient, state, {}, 1, 3);
  CHECK(model.size() == 0);
}
