// Gradients through mirrors and shadows: of the light by definition, in double, by finite differences.
#include <gart/camera/models.hpp>
#include <gart/light/mirror_paths.hpp>

#include <light/double_light.hpp>
#include <light/small_scenes.hpp>
#include <support/kept_results.hpp>

#include <string>
#include <vector>

using namespace gart_test;

namespace {

// A scene's image, and the gradients of a random loss of it. `name` is that of the scene.
template <class E>
void check_gradients(char const* name, std::uint64_t seed, gart::gaussian_model const& model, light::scene const& scene,
                     light::path_options const& paths, double bar) {
  E exec;
  gart::camera const view = camera_at({0.1, -0.063, 0}, 16, 12, 14);
  gart::render_options options;
  options.alpha_min = 1e-7f, options.transmittance_min = 0, options.background = vec3(0.3f, 0.4f, 0.1f);
  std::size_t const pixels = 16 * 12;
  std::mt19937_64 engine(seed + 1);
  std::normal_distribution<float> normal;
  std::vector<float> weights(3 * pixels);
  for (float& w : weights) w = normal(engine);

  auto const image = [&](gart::gaussian_model const& m) {
    double_light const light(m, scene, options, paths);
    std::vector<double> out;
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        vec3d const d(gart::ray_direction(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
        vec3d const c = light(view.position, glm::normalize(d));
        for (int k = 0; k < 3; ++k) out.push_back(c[k]);
      }
    return out;
  };
  auto const loss = [&](std::vector<double> const& colors) {
    double sum = 0;
    for (std::size_t i = 0; i < colors.size(); ++i) sum += double{weights[i]} * colors[i];
    return sum;
  };

  gart::gaussians<E> const there(exec, model);
  gart::gaussians<E> gradients(exec, model.size(), 1);
  gart::mirror_paths<E> mirrors(exec);
  mirrors.set_scene(scene), mirrors.set_model(there.view(), 1);
  gart::buffer<float, E> color(exec, 3 * pixels);
  mirrors.forward(view, options, paths, color.data());
  // Images by definition; `place` is the number in which the model of an image is another.
  kept_results<float, std::vector<double>> kept(name);
  std::vector<double> const expected = kept.of(0, [&] { return image(model); });
  auto const got = color.to_host();
  // Where floats put a hit on the other side of a surface, or of another hit, than doubles, both are right.
  long aside = 0;
  for (std::size_t i = 0; i < got.size(); ++i)
    if (std::fabs(double{got[i]} - expected[i]) > 1e-5 * (1 + expected[i])) weights[i] = 0, ++aside;
  CHECK(aside <= 18);
  mirrors.backward(gart::buffer<float, E>(exec, weights), gradients.view());

  gart::gaussian_model const analytic = gradients.to_host();
  auto const check = [&](char const* what, std::vector<float> gart::gaussian_model::*array, std::size_t each) {
    CAPTURE(what);
    long compared = 0, bad = 0;
    double largest = 0;
    for (float const g : analytic.*array) largest = std::max(largest, std::fabs(double{g}));
    for (std::size_t i = 0; i < (model.*array).size(); i += each) {
      auto const slope = [&](float h) {
        gart::gaussian_model less = model, more = model;
        float &a = (less.*array)[i], &b = (more.*array)[i];
        a -= h, b += h;
        double const above = loss(kept.of(b, [&] { return image(more); }));
        double const below = loss(kept.of(a, [&] { return image(less); }));
        return (above - below) / (double{b} - double{a});
      };
      double const wide = slope(5e-4f), narrow = slope(2.5e-4f), expected_slope = (4 * narrow - wide) / 3,
                   g = double{(analytic.*array)[i]};
      // Across a step both are wrong, each in its way.
      if (std::fabs(wide - narrow) > 2e-4 * (std::fabs(narrow) + 0.1 * largest)) continue;
      ++compared;
      bad += std::fabs(expected_slope - g) > bar * (std::fabs(g) + 0.1 * largest);
    }
    CHECK(compared > 5);
    CHECK(bad == 0);
  };
  check("mean", &gart::gaussian_model::mean, 4);
  check("log_scale", &gart::gaussian_model::log_scale, 4);
  check("quaternion", &gart::gaussian_model::quaternion, 7);
  check("opacity", &gart::gaussian_model::opacity, 2);
  check("sh", &gart::gaussian_model::sh, 17);
}

}  // namespace

TEST_CASE_TEMPLATE("mirrors pass gradients on to what they show", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  light::scene scene;
  scene.meshes = {quad({1.2f, 0, 4.5f}, {1, 0, -1}, {0, -2, 0}, 0), quad({-1.2f, 0, 4.5f}, {1, 0, 1}, {0, -2, 0}, 0),
                  quad({0, 1.2f, 4}, {0.7f, 0, 0}, {0, 0, 0.7f}, 1)};
  scene.materials = {material_of(light::material_kind::mirror, {0.9f, 0.8f, 0.7f}), glowing({0.2f, 0.5f, 0.3f})};
  check_gradients<E>("mirrors", seed, cloud(seed, 25, {0, 0, 4}, 0.7f, true, 1), scene, through_middles(3), 1e-3);
}

// A floor and a wall of a mirror, and a board above that hides the lights from some of the Gaussians.
TEST_CASE_TEMPLATE("shadows on meshes pass gradients on to Gaussians", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  light::scene scene;
  scene.meshes = {quad({0, 1.1f, 4}, {2.5f, 0, 0}, {0, 0, 2.5f}, 1), quad({1.3f, 0, 4.5f}, {1, 0, -1}, {0, -2, 0}, 0),
                  quad({-0.4f, -1.3f, 4}, {0.5f, 0, 0}, {0, 0, 0.6f}, 1)};
  scene.materials = {material_of(light::material_kind::mirror, {0.9f, 0.8f, 0.7f}), matt({0.7f, 0.9f, 0.8f})};
  gart::gaussian_model const model = cloud(seed, 25, {0, 0, 4}, 0.6f, true, 1);
  light::path_options paths = through_middles(2);
  SUBCASE("as they were captured") {
    scene.lights = {sun({0.2f, 1, 0.1f}, {2, 3, 2.5f}), point_light({0.4f, -1.2f, 3.2f}, {4, 2, 3})};
    check_gradients<E>("as captured", seed, model, scene, paths, 1e-3);
  }
  // The light on a Gaussian counts as constant, which that of suns is but for steps.
  scene.lights = {sun({0.2f, 1, 0.1f}, {2, 3, 2.5f}), sun({-0.4f, 1, 0.2f}, {1, 0.5f, 1.5f})};
  paths.shadows = light::shadow_kind::per_gaussian;
  SUBCASE("in the shadow of meshes") { check_gradients<E>("shadowed", seed, model, scene, paths, 1e-3); }
  SUBCASE("lit anew") {
    paths.relight = true;
    check_gradients<E>("lit anew", seed, model, scene, paths, 1e-3);
  }
}

TEST_CASE("gradients refuse what has none") {
  gart::serial_exec exec;
  gart::mirror_paths<gart::serial_exec> mirrors(exec);
  light::path_options paths;
  paths.shadows = light::shadow_kind::per_hit;
  CHECK_THROWS_WITH_AS(mirrors.forward(camera_at({0, 0, 0}), {}, paths, nullptr), doctest::Contains("per-hit"),
                       gart::invalid_argument);
  paths = {}, paths.linear = true;
  CHECK_THROWS_WITH_AS(mirrors.forward(camera_at({0, 0, 0}), {}, paths, nullptr),
                       doctest::Contains("path_options.linear"), gart::invalid_argument);
}
