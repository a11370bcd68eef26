// Gaussians far thinner than the float spacing of their distance: the response and its gradients against the oracle, by
// every tracer and method, where the distance is 1e3 to 1e9 of the thinnest axis.
#include <extremes/scenes.hpp>
#include <extremes/ways.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>

using namespace gart_test;

namespace {

constexpr double away = 10, wide = 0.05, narrow = 0.03, sigma = 0.95;

// One rounding of the distance, in narrow axes; a ray crosses the plane of the wide ones off by it over the sine of the
// angle between them. The response's bound is that, at 45 degrees without the sine; a gradient has some three such
// roundings, weighed with offsets of up to three.
constexpr double rounding = 2e-5;

struct attitude {
  char const* name;
  double angle;  // between ray and plane, radians
  double response;
};
constexpr attitude attitudes[] = {{"face on", 1.5707963267948966, rounding},
                                  {"at 45 degrees", 0.7853981633974483, rounding},
                                  {"grazing", 0.02, rounding / 0.02}};

gart::vec3d unit(gart::vec3d const& a) { return a / std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }
gart::vec3d cross_of(gart::vec3d const& a, gart::vec3d const& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Turned and moved, so that no product of a ray is exact.
gart::camera turned_camera(number_source& random) {
  gart::camera view = looking_along_z(128, 128, 280);
  gart::vec3d const z = unit({random.normal(), random.normal(), random.normal()});
  gart::vec3d const x = unit(cross_of(z, {random.normal(), random.normal(), random.normal()}));
  view.rotation = gart::mat3(gart::vec3(x), gart::vec3(cross_of(z, x)), gart::vec3(z));
  for (int k = 0; k < 3; ++k) view.position[k] = random.uniform(-5, 5);
  return view;
}

// One for each 16 x 16 pixels, too small to overlap: 1 - T is the alpha of one. Its middle pixel's ray meets it.
gart::gaussian_model thin_ones(number_source& random, gart::camera const& view, double thinnest, double angle) {
  gart::gaussian_model m;
  m.sh_degree = 1;
  for (int y = 8; y < view.height; y += 16)
    for (int x = 8; x < view.width; x += 16) {
      auto const ray = oracle::ray_through(view, x, y);
      gart::vec3d const to(ray.x, ray.y, ray.z);
      gart::vec3d const across = unit(cross_of(to, {random.normal(), random.normal(), random.normal()}));
      gart::vec3d const normal = to * std::sin(angle) + across * std::cos(angle);
      gart::vec3d const in_plane = unit(cross_of(normal, {random.normal(), random.normal(), random.normal()}));
      shape s{view.position + to * away + in_plane * (narrow * random.uniform(0, 2.5)),
              {std::log(wide), std::log(narrow), std::log(thinnest)},
              {},
              static_cast<float>(std::log(sigma / (1 - sigma)))};
      turn_z_to(s, normal, random);
      append(m, random, s);
    }
  return m;
}

}  // namespace

// Prints what docs/accuracy.md quotes: GART_TEST_SEED=1 test_extremes --test-case=*thin*
TEST_CASE_TEMPLATE("error budget: thin Gaussians", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  number_source random(seed + 8);
  gart::render_options options;
  options.alpha_min = 1e-5f;
  E exec;
  for (attitude const& a : attitudes)
    for (int power = 3; power <= 9; ++power) {
      CAPTURE(a.name);
      CAPTURE(power);
      gart::camera const view = turned_camera(random);
      gart::gaussian_model const m = thin_ones(random, view, away / std::pow(10.0, power), a.angle);
      std::vector<float> gradient(std::size_t{3} * view.width * view.height);
      for (float& g : gradient) g = static_cast<float>(random.uniform(-1, 1));
      oracle::parameters const parameters(m);
      auto const picture = oracle::render(parameters, view, options, 1);
      // Where a colour is within rounding of its clamp at zero, its gradient may be there or not.
      for (std::size_t i = 0; i < picture.pixels.size(); ++i)
        if (picture.pixels[i].kink) std::fill_n(&gradient[3 * i], 3, 0.0f);
      auto const expected = oracle::gradients(parameters, view, options, 1, {gradient.begin(), gradient.end()});
      auto const all = run_all(exec, m, view, options, gradient);

      double sum = 0, rays = 0;
      for (std::size_t i = 0; i < picture.pixels.size(); ++i) {
        double const t = picture.pixels[i].transmittance;
        if (1 - t < 0.01) continue;
        sum += std::abs(all[0].transmittance[i] - t) / sigma, ++rays;
      }
      CHECK(rays >= static_cast<double>(m.size()));
      CHECK(sum / rays <= a.response);
      std::printf("budget (%s): distance of 1e%d thinnest axes, %-13s response %.0e", E::name, power, a.name,
                  sum / rays);
      for (std::size_t g = 0; g < std::size(parameter_groups); ++g) {
        CAPTURE(parameter_groups[g].name);
        double worst = 0;
        for (outcome const& o : all)
          worst = std::max(worst, relative_error(o.gradients.*parameter_groups[g].got, expected.*oracle_groups[g]));
        CHECK(worst <= 10 * rounding / std::sin(a.angle));
        std::printf(" %s %.0e", parameter_groups[g].name, worst);
      }
      std::printf("\n");
      for (outcome const& o : all) {
        CAPTURE(o.way);
        CHECK(o.color == all[0].color);
        CHECK(o.transmittance == all[0].transmittance);
        CHECK(o.depth == all[0].depth);
      }
    }
}

// A disc at z = distance, of a tenth of that, as thin as there may be: not even double has digits for o + t d, but the
// disc is met where its plane is. Where o.d / d.d is past what floats hold there is no hit, and no infinite depth.
TEST_CASE_TEMPLATE("the thinnest axis at any distance", E, GART_TEST_POLICIES) {
  E exec;
  gart::camera const view = looking_along_z(5, 5, 40);
  std::vector<float> const gradient(std::size_t{3} * view.width * view.height, 1.0f);
  int met = 0;
  for (double const distance : {1.0, 1e3, 1e4, 1e5, 1e10, 1e17}) {
    CAPTURE(distance);
    number_source random(9);
    gart::gaussian_model m;
    m.sh_degree = 1;
    double const across = std::log(0.1 * distance);
    append(m, random, {{0, 0, distance}, {across, across, -39.9}, {1, 0, 0, 0}, 2});
    auto const all = run_all(exec, m, view, {}, gradient);
    bool const hit = all[0].hits[0] != 0;
    met += hit;
    double worst_alpha = 0, worst_depth = 0;
    for (std::size_t i = 0; i < all[0].hits.size(); ++i) {
      auto const ray = oracle::ray_through(view, static_cast<int>(i % 5), static_cast<int>(i / 5));
      double const x = ray.x / ray.z, y = ray.y / ray.z;
      double const alpha = hit ? std::exp(-50 * (x * x + y * y)) / (1 + std::exp(-2.0)) : 0;
      CHECK(all[0].hits[i] == hit);
      worst_alpha = std::max(worst_alpha, std::abs(1 - all[0].transmittance[i] - alpha));
      worst_depth = std::max(worst_depth, std::abs(all[0].depth[i] / distance * ray.z - alpha));
    }
    CHECK(worst_alpha < 1e-5);
    CHECK(worst_depth < 1e-5);
    for (outcome const& o : all) {
      CAPTURE(o.way);
      CHECK(o.transmittance == all[0].transmittance);
      CHECK(o.depth == all[0].depth);
    }
  }
  CHECK(met >= 2);
}
