// The oracle against central differences of its own images.
#include <oracle/oracle.hpp>
#include <oracle/scenes.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace {

using doubles = std::vector<double>;

struct group {
  std::string name;
  doubles oracle::parameters::*values;
};
group const groups[] = {{"mean", &oracle::parameters::mean},
                        {"log_scale", &oracle::parameters::log_scale},
                        {"quaternion", &oracle::parameters::quaternion},
                        {"opacity", &oracle::parameters::opacity},
                        {"sh", &oracle::parameters::sh}};

struct difference {
  doubles color, transmittance, depth;  // per pixel, by one parameter
};

void check(oracle::scene const& s, int kernel_degree = 2, double tolerance = 1e-6) {
  oracle::parameters m(s.model);
  m.kernel_degree = kernel_degree;
  auto const render = [&] { return oracle::render(m, s.view, s.options, s.active_degree); };
  auto const base = render();
  std::size_t const pixels = base.pixels.size();
  std::vector<bool> usable(pixels, true);

  double smallest = 1;
  for (double l : m.log_scale) smallest = std::min(smallest, std::exp(l));
  std::vector<std::vector<difference>> differences(std::size(groups));
  for (std::size_t g = 0; g < std::size(groups); ++g) {
    // Small against the thinnest axis: a mean moves the ray across it, and a rotation does so at the camera's distance.
    double const h = groups[g].values == &oracle::parameters::mean         ? 1e-4 * smallest
                     : groups[g].values == &oracle::parameters::quaternion ? 1e-5 * smallest
                                                                           : 1e-5;
    for (double& x : m.*groups[g].values) {
      double const kept = x;
      x = kept + h;
      auto const plus = render();
      x = kept - h;
      auto const minus = render();
      x = kept;
      difference d{doubles(3 * pixels), doubles(pixels), doubles(pixels)};
      for (std::size_t p = 0; p < pixels; ++p) {
        usable[p] = usable[p] && oracle::same_branches(base.pixels[p], plus.pixels[p]) &&
                    oracle::same_branches(base.pixels[p], minus.pixels[p]);
        for (int c = 0; c < 3; ++c) d.color[3 * p + c] = (plus.pixels[p].color[c] - minus.pixels[p].color[c]) / (2 * h);
        d.depth[p] = (plus.pixels[p].depth - minus.pixels[p].depth) / (2 * h);
        d.transmittance[p] = (plus.pixels[p].transmittance - minus.pixels[p].transmittance) / (2 * h);
      }
      differences[g].push_back(std::move(d));
    }
  }
  REQUIRE(std::count(usable.begin(), usable.end(), true) > long(pixels / 2));

  std::mt19937_64 engine(gart_test::seed());
  std::normal_distribution<double> normal;
  doubles by_color(3 * pixels), by_transmittance(pixels), by_depth(pixels);
  for (std::size_t p = 0; p < pixels; ++p) {
    for (int c = 0; c < 3; ++c) by_color[3 * p + c] = usable[p] ? normal(engine) : 0;
    by_transmittance[p] = usable[p] ? normal(engine) : 0;
    by_depth[p] = usable[p] ? normal(engine) : 0;
  }
  auto const exact = oracle::gradients(m, s.view, s.options, s.active_degree, by_color, by_transmittance, by_depth);
  for (std::size_t g = 0; g < std::size(groups); ++g) {
    CAPTURE(groups[g].name);
    double error = 0, norm = 0;
    for (std::size_t i = 0; i < differences[g].size(); ++i) {
      double expected = 0;
      for (std::size_t k = 0; k < 3 * pixels; ++k) expected += by_color[k] * differences[g][i].color[k];
      for (std::size_t k = 0; k < pixels; ++k) expected += by_transmittance[k] * differences[g][i].transmittance[k];
      for (std::size_t k = 0; k < pixels; ++k) expected += by_depth[k] * differences[g][i].depth[k];
      double const got = (exact.*groups[g].values)[i];
      error += (got - expected) * (got - expected), norm += expected * expected;
    }
    REQUIRE(norm > 0);
    CHECK(std::sqrt(error / norm) < tolerance);
  }
}

}  // namespace

TEST_CASE("gradients agree with central differences") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  for (int degree = 0; degree <= 3; ++degree) {
    CAPTURE(degree);
    check(oracle::smooth_scene(seed + degree, degree, 2.0f));
  }
}

TEST_CASE("gradients match central differences at every kernel degree") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  // A difference across the cusp of degree 1 is off where a ray passes the centre closely.
  for (int degree : {1, 3, 4, 5, 8}) {
    CAPTURE(degree);
    check(oracle::smooth_scene(seed + degree, 0, 2.0f), degree, degree == 1 ? 1e-4 : 1e-6);
  }
}

TEST_CASE("gradients agree with central differences for needles") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  for (float aspect : {30.0f, 1000.0f}) {
    CAPTURE(aspect);
    check(oracle::smooth_scene(seed, 1, aspect));
  }
}

TEST_CASE("gradients match central differences through pixel filters") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  for (float aspect : {2.0f, 30.0f}) {
    CAPTURE(aspect);
    auto s = oracle::smooth_scene(seed, 1, aspect);
    s.options.antialias = 0.7f;
    check(s);
  }
}

TEST_CASE("bands above the active degree have no gradient or effect") {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  auto s = oracle::smooth_scene(seed, 3, 2.0f);
  s.active_degree = 1;
  check(s);
  doubles const ones(3 * std::size_t(s.view.width) * s.view.height, 1.0);
  auto const g = oracle::gradients(oracle::parameters(s.model), s.view, s.options, 1, ones);
  for (std::size_t i = 0; i < g.sh.size(); ++i)
    if (i / 3 % 16 >= 4) CHECK(g.sh[i] == 0);
}
