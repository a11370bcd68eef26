#include <support/policies.hpp>

#include <gart/loss/error_map.hpp>
#include <gart/loss/image_loss.hpp>

#include "oracle.hpp"

#include <algorithm>
#include <limits>

using namespace gart;

namespace {

struct case_data {
  int width, height;
  std::vector<float> image;
  std::vector<u8> truth, mask;
  int channels = 3;
  vec3 background{0.0f};

  // What the loss compares, in double.
  std::vector<double> truth_values() const {
    std::vector<double> y(image.size());
    for (std::size_t p = 0; p < image.size() / 3; ++p)
      for (int c = 0; c < 3; ++c) {
        double const alpha = channels == 4 ? truth[p * 4 + 3] / 255.0 : 1.0;
        y[p * 3 + c] = truth[p * channels + c] / 255.0 * alpha + background[c] * (1 - alpha);
      }
    return y;
  }
  std::vector<double> image_values(std::vector<double> const& y) const {
    std::vector<double> x(image.begin(), image.end());
    for (std::size_t i = 0; i < x.size(); ++i)
      if ((!mask.empty() && mask[i / 3] == 0) || is_beyond_white(i, y)) x[i] = y[i];
    return x;
  }
  bool is_beyond_white(std::size_t i, std::vector<double> const& y) const { return image[i] > 1 && y[i] * 255 > 249.5; }
};

// A smooth image with noise of the given size around the truth: what training sees.
case_data make_case(int width, int height, int channels, bool masked, double noise, std::mt19937_64& random) {
  std::uniform_real_distribution<double> u(0, 1);
  case_data d{width, height, {}, {}, {}, channels, vec3(0.2f, 0.9f, 0.5f)};
  d.image.resize(static_cast<std::size_t>(width) * height * 3);
  d.truth.resize(static_cast<std::size_t>(width) * height * channels);
  for (auto& t : d.truth) {
    double const kind = u(random);
    t = static_cast<u8>(kind < 0.4 ? 200 : kind < 0.6 ? 245 + 11 * u(random) : 255 * u(random));
  }
  if (masked) {
    d.mask.resize(static_cast<std::size_t>(width) * height);
    for (auto& m : d.mask) m = u(random) < 0.3 ? 0 : 255;
  }
  auto const y = d.truth_values();
  for (std::size_t i = 0; i < y.size(); ++i) d.image[i] = static_cast<float>(y[i] + noise * (2 * u(random) - 1) + 0.01);
  return d;
}

struct result {
  std::vector<float> gradient, loss;
};

template <class E>
result evaluate(E& exec, case_data const& d, float weight) {
  buffer<float, E> image(exec, d.image), gradient(exec, d.image.size()), loss(exec, 2);
  buffer<u8, E> truth(exec, d.truth), mask(exec, d.mask);
  image_loss<E> l(exec);
  l.evaluate(image, {truth.data(), d.channels, d.mask.empty() ? nullptr : mask.data(), d.background}, d.width, d.height,
             weight, gradient, loss);
  return {gradient.to_host(), loss.to_host()};
}

}  // namespace

TEST_CASE_TEMPLATE("loss and gradient are those of the definition", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  struct {
    int width, height, channels;
    bool masked;
    double noise;
    float weight;
  } const cases[] = {{37, 21, 3, false, 0.5, 0.2f}, {33, 17, 4, false, 0.02, 0.2f}, {32, 16, 3, true, 0.3, 0.5f},
                     {5, 40, 4, true, 0.3, 1.0f},   {1, 1, 3, false, 0.5, 0.2f},    {110, 7, 3, false, 0.2, 0.0f}};
  for (auto const& c : cases) {
    CAPTURE(c.width);
    CAPTURE(c.height);
    case_data const d = make_case(c.width, c.height, c.channels, c.masked, c.noise, random);
    result const got = evaluate(exec, d, c.weight);
    auto const y = d.truth_values();
    auto x = d.image_values(y);
    auto const expected = gart_test::naive_loss(x, y, c.width, c.height);
    CHECK(got.loss[0] == doctest::Approx(expected.total(c.weight)).epsilon(1e-5));
    CHECK(got.loss[1] == doctest::Approx(expected.mse).epsilon(1e-5));

    // Central differences of the definition, at some pixels; relative to the largest gradient.
    double largest = 0, worst = 0;
    for (float const g : got.gradient) largest = std::max(largest, std::abs(static_cast<double>(g)));
    CHECK(largest > 0);
    for (int sample = 0; sample < 60; ++sample) {
      std::size_t const i = random() % x.size();
      if ((!d.mask.empty() && d.mask[i / 3] == 0) || d.is_beyond_white(i, y)) {
        CHECK(got.gradient[i] == 0.0f);
        continue;
      }
      double const h = 1e-6, kept = x[i];
      if (std::abs(kept - y[i]) < 2 * h) continue;
      x[i] = kept + h;
      double const above = gart_test::naive_loss(x, y, c.width, c.height).total(c.weight);
      x[i] = kept - h;
      double const below = gart_test::naive_loss(x, y, c.width, c.height).total(c.weight);
      x[i] = kept;
      worst = std::max(worst, std::abs((above - below) / (2 * h) - got.gradient[i]));
    }
    CHECK(worst < 1e-4 * largest);
  }
}

TEST_CASE_TEMPLATE("an image equal to the truth has no loss and no gradient", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  case_data d = make_case(45, 30, 3, false, 0, random);
  for (std::size_t i = 0; i < d.image.size(); ++i) d.image[i] = static_cast<float>(d.truth[i]) * (1.0f / 255.0f);
  result const got = evaluate(exec, d, 0.2f);
  CHECK(got.loss[0] == 0.0f);
  CHECK(got.loss[1] == 0.0f);
  for (float const g : got.gradient) REQUIRE(g == 0.0f);
}

TEST_CASE_TEMPLATE("an overexposed sky is white however bright it was", E, GART_TEST_POLICIES) {
  E exec;
  case_data d{30, 24, std::vector<float>(30 * 24 * 3, 1.4f), std::vector<u8>(30 * 24 * 3, 251), {}};
  result const white = evaluate(exec, d, 0.2f);
  CHECK(white.loss[0] == 0.0f);
  for (float const g : white.gradient) REQUIRE(g == 0.0f);
  d.image[0] = 0.9f, d.truth[100] = 240;  // darker than white; grey that is too bright
  result const got = evaluate(exec, d, 0.2f);
  CHECK(got.gradient[0] < 0);
  CHECK(got.gradient[100] > 0);
  CHECK(got.gradient[1] == 0.0f);

  buffer<float, E> image(exec, d.image), error(exec);
  buffer<u8, E> truth(exec, d.truth);
  error_map(exec, image, {truth.data()}, error);
  std::vector<float> const errors = error.to_host();
  CHECK(errors[0] == doctest::Approx((251 / 255.0 - 0.9) / 3).epsilon(1e-5));
  CHECK(errors[100 / 3] == doctest::Approx((1.4 - 240 / 255.0) / 3).epsilon(1e-5));
  CHECK(errors[1] == 0.0f);
}

TEST_CASE_TEMPLATE("a mask that hides everything leaves nothing", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  case_data d = make_case(20, 20, 3, true, 0.4, random);
  for (auto& m : d.mask) m = 0;
  d.image[7] = NAN;
  result const got = evaluate(exec, d, 0.2f);
  CHECK(got.loss[0] == 0.0f);
  for (float const g : got.gradient) REQUIRE(g == 0.0f);
}

TEST_CASE_TEMPLATE("a mask weighs gradients in parts of 255", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  case_data d = make_case(20, 24, 3, false, 0.4, random);
  result const unweighted = evaluate(exec, d, 0.2f);
  d.mask.assign(20 * 24, 255);
  CHECK(evaluate(exec, d, 0.2f).gradient == unweighted.gradient);
  for (std::size_t i = 0; i < d.mask.size(); ++i) d.mask[i] = i % 2 ? 51 : 255;
  result const got = evaluate(exec, d, 0.2f);
  for (std::size_t i = 0; i < got.gradient.size(); ++i)
    REQUIRE(got.gradient[i] == doctest::Approx(unweighted.gradient[i] * (i / 3 % 2 ? 0.2f : 1.0f)).epsilon(1e-6));
}

TEST_CASE_TEMPLATE("the same image gives the same bits, at any size", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  case_data const d = make_case(100, 75, 4, true, 0.4, random), small = make_case(9, 9, 3, false, 0.4, random);
  result const a = evaluate(exec, d, 0.2f), b = evaluate(exec, d, 0.2f);
  CHECK(a.loss == b.loss);
  CHECK(a.gradient == b.gradient);

  image_loss<E> reused(exec);
  for (case_data const* each : {&d, &small, &d}) {
    buffer<float, E> image(exec, each->image), gradient(exec, each->image.size()), loss(exec, 2);
    buffer<u8, E> truth(exec, each->truth), mask(exec, each->mask);
    reused.evaluate(image, {truth.data(), each->channels, each->mask.empty() ? nullptr : mask.data(), each->background},
                    each->width, each->height, 0.2f, gradient, loss);
    result const fresh = evaluate(exec, *each, 0.2f);
    CHECK(gradient.to_host() == fresh.gradient);
    CHECK(loss.to_host() == fresh.loss);
  }
}

TEST_CASE_TEMPLATE("a strip has the whole image's bits and reads its rows alone", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  using loss_type = image_loss<E>;
  for (auto const& [width, height] : {std::pair{100, 203}, {37, 21}, {5, 97}}) {
    CAPTURE(width);
    case_data const d = make_case(width, height, 4, true, 0.4, random);
    result const whole = evaluate(exec, d, 0.2f);
    std::size_t const row = static_cast<std::size_t>(width) * 3;
    // Where tiles of either policy end there is no room to spare about a strip.
    std::vector<int> cuts = {0,          std::min(32, height), std::min(64, height), height / 5,
                             height / 2, height / 2,           height / 2 + 8,       image_rows::most};
    std::sort(cuts.begin(), cuts.end());
    std::vector<float> sums[2];
    for (std::size_t k = 0; k + 1 < cuts.size(); ++k) {
      CAPTURE(k);
      image_rows const rows{cuts[k], cuts[k + 1]}, read = loss_type::reads(rows, height);
      std::vector<float> seen(d.image.size(), std::numeric_limits<float>::quiet_NaN());
      std::copy(d.image.begin() + static_cast<std::ptrdiff_t>(row) * read.first,
                d.image.begin() + static_cast<std::ptrdiff_t>(row) * read.end,
                seen.begin() + static_cast<std::ptrdiff_t>(row) * read.first);
      buffer<float, E> image(exec, seen), gradient(exec, d.image.size());
      buffer<u8, E> truth(exec, d.truth), mask(exec, d.mask);
      loss_type l(exec);
      // Its buffers hold what an image of nothing but NaN has left there, where a strip must not look.
      buffer<float, E> none(exec, std::vector<float>(d.image.size(), std::numeric_limits<float>::quiet_NaN()));
      l.differentiate(none, {truth.data(), d.channels, nullptr, d.background}, width, height, 0.2f, gradient);
      l.differentiate(image, {truth.data(), d.channels, mask.data(), d.background}, width, height, 0.2f, gradient,
                      rows);
      auto const got = gradient.to_host();
      for (std::size_t i = row * static_cast<std::size_t>(rows.first);
           i < row * static_cast<std::size_t>(std::min(rows.end, height)); ++i)
        REQUIRE(got[i] == whole.gradient[i]);
      image_rows const begun = loss_type::sums_of(rows, height);
      int const all = loss_type::sums_of({}, height).end;
      for (int which = 0; which < 2; ++which) {
        std::vector<float> mine(l.sums(which).size());
        exec.copy_out(mine.data(), l.sums(which).data(), mine.size() * sizeof(float));
        auto const wide = static_cast<std::ptrdiff_t>(mine.size()) / all;
        CHECK(begun.first * wide == static_cast<std::ptrdiff_t>(sums[which].size()));
        sums[which].insert(sums[which].end(), mine.begin() + wide * begun.first,
                           mine.begin() + wide * std::max(begun.end, begun.first));
      }
    }
    // All strips' sums are those of the image.
    loss_type l(exec);
    buffer<float, E> image(exec, d.image), gradient(exec, d.image.size()), loss(exec, 2);
    buffer<u8, E> truth(exec, d.truth), mask(exec, d.mask);
    l.differentiate(image, {truth.data(), d.channels, mask.data(), d.background}, width, height, 0.2f, gradient);
    for (int which = 0; which < 2; ++which) {
      REQUIRE(sums[which].size() == l.sums(which).size());
      exec.copy_in(l.sums(which).data(), sums[which].data(), sums[which].size() * sizeof(float));
    }
    l.total(loss);
    CHECK(loss.to_host() == whole.loss);
  }
}
