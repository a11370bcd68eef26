// Gradients where float has few digits: opacities that saturate, long rows of hits along a ray, sums in any order.
#include <extremes/scenes.hpp>
#include <extremes/ways.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace gart_test;

TEST_CASE_TEMPLATE("opacity's gradient keeps its digits at the ends of sigma", E, GART_TEST_POLICIES) {
  // One Gaussian a pixel, its ray at |p| of 1 to 2 in the mean: alpha is below its clamp whatever sigma is.
  float const logits[] = {3, 6, 9, 12, 15, 17, 20, 30, 40, 60, 80};
  int const n = static_cast<int>(std::size(logits));
  number_source random(5);
  gart::camera view = looking_along_z(8 * n, 1, 100);
  gart::gaussian_model m;
  m.sh_degree = 1;
  for (int i = 0; i < n; ++i) {
    auto const ray = oracle::ray_through(view, 8 * i + 4, 0);
    gart::vec3d const at(ray.x * 2 / ray.z, ray.y * 2 / ray.z + 0.014, 2);
    append(m, random, {at, gart::vec3d(std::log(0.01)), {1, 0, 0, 0}, logits[i]});
    for (int c = 0; c < 3; ++c) m.sh[m.sh.size() - 12 + static_cast<std::size_t>(c)] = 1;
  }
  gart::render_options const options;
  std::vector<float> const gradient(std::size_t{3} * view.width, 1.0f);
  oracle::parameters const parameters(m);
  auto const expected = oracle::gradients(parameters, view, options, 1, {gradient.begin(), gradient.end()});
  E exec;
  for (outcome const& o : run_all(exec, m, view, options, gradient)) {
    CAPTURE(o.way);
    for (int i = 0; i < n; ++i) {
      CAPTURE(logits[i]);
      auto const k = static_cast<std::size_t>(i);
      REQUIRE(expected.opacity[k] != 0);
      CHECK(std::abs(o.gradients.opacity[k] / expected.opacity[k] - 1) < 2e-5);
    }
  }
}

namespace {

// Rows of hits at |p| = 0, one row a pixel, that no other pixel meets: T and alpha of each are known.
struct chains {
  static constexpr int rays = 64, length = 20;
  gart::gaussian_model model;
  gart::camera view = looking_along_z(rays, 1, 100);
  gart::render_options options;
  std::vector<double> alpha, before, brightness;  // of each Gaussian; T before it; the sum of its channels

  explicit chains(number_source& random) {
    model.sh_degree = 1;
    options.transmittance_min = 0;
    for (int r = 0; r < rays; ++r) {
      auto const ray = oracle::ray_through(view, r, 0);
      double t = 1;
      for (int k = 0; k < length; ++k) {
        double const distance = 2 + 0.5 * k, a = 1 - random.log_uniform(0.02, 0.9);
        append(model, random,
               {gart::vec3d(ray.x, ray.y, ray.z) * distance,
                gart::vec3d(std::log(0.002 * distance)),
                {1, 0, 0, 0},
                static_cast<float>(std::log(a / (1 - a)))});
        brightness.push_back(1.5);
        for (std::size_t c = 0; c < 12; ++c) {
          float& x = model.sh[model.sh.size() - 12 + c];
          x = c < 3 ? static_cast<float>(random.uniform(0, 2)) : 0.0f;
          if (c < 3) brightness.back() += 0.28209479177387814 * double{x};
        }
        alpha.push_back(a), before.push_back(t);
        t *= 1 - a;
      }
    }
  }
};

}  // namespace

TEST_CASE_TEMPLATE("error budget: derivatives by alpha along a ray", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  number_source random(seed + 6);
  chains const c(random);
  std::vector<float> const gradient(std::size_t{3} * c.view.width, 1.0f);
  oracle::parameters const parameters(c.model);
  auto const expected = oracle::gradients(parameters, c.view, c.options, 1, {gradient.begin(), gradient.end()});
  auto const picture = oracle::render(parameters, c.view, c.options, 1);
  E exec;
  auto const all = run_all(exec, c.model, c.view, c.options, gradient);
  double worst_t = 0;
  for (std::size_t r = 0; r < picture.pixels.size(); ++r) {
    REQUIRE(picture.pixels[r].hits == chains::length);
    worst_t = std::max(worst_t, std::abs(all[0].transmittance[r] / picture.pixels[r].transmittance - 1));
  }
  std::printf("budget (%s): T after %d hits, relative: %.1e\n", E::name, chains::length, worst_t);
  CHECK(worst_t < 5e-5);  // 20 factors 1 - alpha, each off by 2^-24 or two over at least 0.02
  for (outcome const& o : all) {
    CAPTURE(o.way);
    // Of dL/dalpha, relative to T c.g: worst of the hits met at T in a decade.
    double decade[12] = {};
    for (std::size_t i = 0; i < c.alpha.size(); ++i) {
      double const by_alpha = c.alpha[i] * (1 - c.alpha[i]);
      double const error =
          std::abs(o.gradients.opacity[i] - expected.opacity[i]) / (by_alpha * c.before[i] * c.brightness[i]);
      auto const bin = static_cast<std::size_t>(std::min(11.0, -std::log10(c.before[i])));
      decade[bin] = std::max(decade[bin], error);
      // C.g is 4 at most; C and V are sums of up to 20 floats, then multiplied by g, added up and subtracted: their
      // roundings are at most 2^-24 of C.g each. 1 / (1 - alpha) magnifies the difference.
      double const bound = 32 * std::ldexp(4.0, -24) / (c.before[i] * (1 - c.alpha[i]) * c.brightness[i]) + 1e-5;
      REQUIRE(error < bound);
    }
    std::printf("budget (%s): dL/dalpha, %-22s by T:", E::name, o.way.c_str());
    for (int k = 0; k < 8; ++k) std::printf(" 1e-%d %.0e", k, decade[k]);
    std::printf("\n");
  }
}

TEST_CASE_TEMPLATE("error budget: atomics in any order against ordered sums", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  number_source random(seed + 7);
  gart::gaussian_model const model = cloud(random, 200);
  gart::camera const view = looking_along_z(64, 48, 60);
  auto const gradient = random_gradient(random, view);
  E exec;
  std::vector<outcome> by_pixel, ordered;
  for (int k = 0; k < 5; ++k) {
    by_pixel.push_back(run_one(exec, tracer_kind::tiles, "pixel", model, view, {}, gradient));
    ordered.push_back(run_one(exec, tracer_kind::tiles, "deterministic", model, view, {}, gradient));
  }
  for (auto const& group : parameter_groups) {
    double spread = 0;
    for (int k = 1; k < 5; ++k) {
      CHECK(ordered[k].gradients.*group.got == ordered[0].gradients.*group.got);
      auto const& first = by_pixel[0].gradients.*group.got;
      spread = std::max(spread, relative_error(by_pixel[k].gradients.*group.got, {first.begin(), first.end()}));
    }
    std::printf("budget (%s): spread of 5 runs by pixel, %s: %.0e\n", E::name, group.name, spread);
    CHECK(spread < 1e-5);  // some hundred terms a sum, each rounding 2^-24 of it
  }
}
