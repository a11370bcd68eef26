// The reference renderer against the oracle: two evaluations in double of one definition, that share no code.
#include <gart/core/error.hpp>
#include <gart/reference/reference.hpp>
#include <oracle/oracle.hpp>
#include <oracle/scenes.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace {

using doubles = std::vector<double>;

struct kernel_scene {
  oracle::scene scene;
  int kernel_degree = 2;
};

// Many blocks, most of which most of the Gaussians cannot be met from.
oracle::scene from_afar() {
  oracle::scene s = oracle::scenes(gart_test::seed()).front();
  s.name = "cloud, from afar through a long lens";
  s.view.width = 150, s.view.height = 110;
  s.view.fx *= 6, s.view.fy *= 6, s.view.cx = 75, s.view.cy = 55;
  return s;
}

std::vector<kernel_scene> all_scenes() {
  std::vector<kernel_scene> all;
  for (auto const& s : oracle::scenes(gart_test::seed())) all.push_back({s});
  all.push_back({oracle::smooth_scene(gart_test::seed(), 3, 1000.0f)});  // hits behind the camera count
  all.push_back({from_afar()});
  for (int degree : {1, 3, 4, 5, 8}) all.push_back({oracle::kernel_scene(gart_test::seed(), degree), degree});
  return all;
}

doubles random_gradient(std::size_t pixels) {
  std::mt19937_64 engine(gart_test::seed() + 7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  doubles out(3 * pixels);
  for (double& x : out) x = uniform(engine);
  return out;
}

// Decided otherwise by the last bits of double: a hit at its threshold.
bool undecided(oracle::pixel const& p, gart::render_options const& o) {
  double const alpha_min = o.alpha_min, t_min = o.transmittance_min;
  bool close = t_min > 0 && std::abs(p.transmittance / t_min - 1) < 1e-12;
  for (auto const& h : p.list) close |= std::abs(h.alpha / alpha_min - 1) < 1e-12 || std::abs(h.t - o.near) < 1e-12;
  return close;
}

double relative_error(doubles const& got, doubles const& expected) {
  double error = 0, norm = 0;
  REQUIRE(got.size() == expected.size());
  for (std::size_t i = 0; i < got.size(); ++i) {
    error += (got[i] - expected[i]) * (got[i] - expected[i]), norm += expected[i] * expected[i];
  }
  return error == 0 ? 0 : std::sqrt(error / norm);
}

void check_gradients(gart::reference_gradients const& got, oracle::parameters const& expected) {
  CHECK(relative_error(got.mean, expected.mean) < 1e-9);
  CHECK(relative_error(got.log_scale, expected.log_scale) < 1e-9);
  CHECK(relative_error(got.quaternion, expected.quaternion) < 1e-9);
  CHECK(relative_error(got.opacity, expected.opacity) < 1e-9);
  CHECK(relative_error(got.sh, expected.sh) < 1e-9);
}

}  // namespace

TEST_CASE("images and gradients are the oracle's") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  for (auto const& [s, kernel_degree] : all_scenes()) {
    CAPTURE(s.name);
    CAPTURE(kernel_degree);
    oracle::parameters m(s.model);
    m.kernel_degree = kernel_degree;
    auto const expected = oracle::render(m, s.view, s.options, s.active_degree);
    auto gradient = random_gradient(expected.pixels.size());
    for (std::size_t p = 0; p < expected.pixels.size(); ++p)
      if (undecided(expected.pixels[p], s.options)) gradient[3 * p] = gradient[3 * p + 1] = gradient[3 * p + 2] = 0;
    auto const got = gart::trace_reference(s.model, s.view, s.options, s.active_degree, gart::all_pixels(s.view),
                                           gradient, kernel_degree);
    double worst = 0;
    std::size_t aside = 0;
    for (std::size_t p = 0; p < expected.pixels.size(); ++p) {
      auto const& e = expected.pixels[p];
      if (undecided(e, s.options)) {
        ++aside;
        continue;
      }
      REQUIRE(got.hits[p] == e.hits);
      for (int c = 0; c < 3; ++c) worst = std::max(worst, std::abs(got.color[3 * p + c] - e.color[c]));
      worst = std::max(worst, std::abs(got.transmittance[p] - e.transmittance));
      worst = std::max(worst, std::abs(got.depth[p] - e.depth) / (1 + std::abs(e.depth)));
    }
    CHECK(worst < 1e-12);
    CHECK(aside <= 2);
    check_gradients(got.gradients, oracle::gradients(m, s.view, s.options, s.active_degree, gradient));
    // Of the same random numbers, the first of each pixel as the depth's.
    doubles by_depth(expected.pixels.size());
    for (std::size_t p = 0; p < by_depth.size(); ++p) by_depth[p] = gradient[3 * p];
    auto const deep = gart::trace_reference(s.model, s.view, s.options, s.active_degree, gart::all_pixels(s.view),
                                            gradient, kernel_degree, by_depth);
    check_gradients(deep.gradients, oracle::gradients(m, s.view, s.options, s.active_degree, gradient, {}, by_depth));
  }
}

TEST_CASE("pixels in any order are the image's, as their gradients") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  auto const s = from_afar();
  auto order = gart::all_pixels(s.view);
  std::mt19937_64 engine(seed);
  std::shuffle(order.begin(), order.end(), engine);
  order.resize(200);
  auto const gradient = random_gradient(order.size());
  auto const whole = gart::trace_reference(s.model, s.view, s.options, s.active_degree, gart::all_pixels(s.view));
  auto const some = gart::trace_reference(s.model, s.view, s.options, s.active_degree, order, gradient);
  CHECK(whole.gradients.mean.empty());
  doubles spread(3 * whole.hits.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    REQUIRE(some.hits[k] == whole.hits[order[k]]);
    for (int c = 0; c < 3; ++c) {
      CHECK(some.color[3 * k + c] == whole.color[3 * order[k] + c]);
      spread[3 * order[k] + c] = gradient[3 * k + c];
    }
  }
  check_gradients(some.gradients,
                  oracle::gradients(oracle::parameters(s.model), s.view, s.options, s.active_degree, spread));

  auto const again = gart::trace_reference(s.model, s.view, s.options, s.active_degree, order, gradient);
  CHECK(again.gradients.quaternion == some.gradients.quaternion);
  CHECK(again.gradients.sh == some.gradients.sh);
}

TEST_CASE("no Gaussian that is hit is left out of a block") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  auto s = oracle::scenes(seed).front();
  s.view.width = s.view.height = 96;
  s.view.fx = s.view.fy = 75, s.view.cx = s.view.cy = 48;
  // Balls, whose hits reach the sphere they are bounded by, about as large as a block.
  std::mt19937_64 engine(seed + 1);
  std::normal_distribution<float> normal;
  s.model.resize(3000, 0);
  for (auto& x : s.model.mean) x = normal(engine);
  for (std::size_t i = 0; i < s.model.size(); ++i) {
    std::fill_n(s.model.log_scale.begin() + 3 * i, 3, -3 + normal(engine));
    s.model.opacity[i] = -4 + normal(engine);
    std::fill_n(s.model.quaternion.begin() + 4 * i, 4, 1.0f);
  }
  s.options.transmittance_min = 0;
  auto const pixels = gart::all_pixels(s.view);
  s.options.near = 0;
  auto const tested = gart::trace_reference(s.model, s.view, s.options, 0, pixels);
  s.options.near = -1e-30f;  // hits behind the camera could count: every block holds every Gaussian
  auto const untested = gart::trace_reference(s.model, s.view, s.options, 0, pixels);
  CHECK(tested.hits == untested.hits);
  CHECK(tested.color == untested.color);
}

TEST_CASE("what the renderer culls is not there") {
  auto s = oracle::scenes(gart_test::seed()).front();
  auto const pixels = gart::all_pixels(s.view);
  auto without = s.model;
  std::fill_n(without.opacity.begin(), 5, -30.0f);  // too weak to be hit
  auto const expected = gart::trace_reference(without, s.view, s.options, 3, pixels);
  s.model.mean[0] = INFINITY, s.model.log_scale[3] = 41, s.model.log_scale[7] = NAN;
  std::fill_n(s.model.quaternion.begin() + 12, 4, 1e-5f);
  s.model.opacity[4] = NAN;
  CHECK(gart::trace_reference(s.model, s.view, s.options, 3, pixels).color == expected.color);
}

TEST_CASE("what cannot be asked for is refused by name") {
  auto const s = oracle::scenes(gart_test::seed()).front();
  auto const ask = [&](std::vector<gart::u32> const& pixels, doubles const& gradient, int degree) {
    return gart::trace_reference(s.model, s.view, s.options, degree, pixels, gradient);
  };
  CHECK_THROWS_AS(ask({37 * 23}, {}, 3), gart::invalid_argument);
  CHECK_THROWS_AS(ask({5, 5}, {}, 3), gart::invalid_argument);
  CHECK_THROWS_AS(ask({5}, {1, 2}, 3), gart::invalid_argument);
  CHECK_THROWS_AS(ask({5}, {}, 4), gart::invalid_argument);
  CHECK(ask({}, {}, 3).hits.empty());
  auto broken = s.view;
  broken.lens.k1 = NAN;
  CHECK_THROWS_AS(gart::trace_reference(s.model, broken, s.options, 3, {0}), gart::invalid_argument);
}
