// What light must do, whatever it is computed by: no energy is made or lost, mirrors mirror, glass bends by Snell's
// law, shadows are as soft as their light is large, and all ways to draw a direction have one mean.
#include <gart/light/surface.hpp>

#include <light/small_scenes.hpp>
#include <rays/view_rays.hpp>

using namespace gart_test;

namespace {

vec3d mean_of(std::vector<float> const& image) {
  vec3d sum(0.0);
  for (std::size_t i = 0; i < image.size(); ++i) sum[static_cast<int>(i % 3)] += double{image[i]};
  return sum / static_cast<double>(image.size() / 3);
}

// Gaussians that nobody sees.
gart::gaussian_model nothing() { return cloud(1, 1, {0, 0, -50}, 0.1f); }

}  // namespace

TEST_CASE_TEMPLATE("in a white furnace nothing is seen", E, GART_TEST_POLICIES) {
  E exec;
  light::scene scene;
  scene.meshes = {ball({0, 0, 4}, 1, 0, 24, true)};
  scene.around.color = vec3(1.0f);
  light::path_options paths;
  paths.bounces = 12, paths.roulette_after = 64;
  gart::camera const view = camera_at({}, 16, 16, 24);  // the ball fills it
  light::material rough = material_of(light::material_kind::surface);
  std::vector<light::material> materials{matt(vec3(1.0f)), material_of(light::material_kind::mirror),
                                         material_of(light::material_kind::dielectric)};
  for (float const roughness : {0.05f, 0.3f, 0.7f, 1.0f})
    for (float const metallic : {0.0f, 1.0f})
      rough.roughness = roughness, rough.metallic = metallic, materials.push_back(rough);
  for (light::material const& m : materials) {
    CAPTURE(gart::to_string(m.kind));
    CAPTURE(m.roughness);
    CAPTURE(m.metallic);
    scene.materials = {m};
    std::vector<float> const image = picture(exec, nothing(), scene, view, {}, paths, 64);
    vec3d const mean = mean_of(image);
    CHECK(mean.x == doctest::Approx(1).epsilon(0.005));
    CHECK(mean.z == doctest::Approx(mean.x).epsilon(1e-5));
  }
}

TEST_CASE_TEMPLATE("a mirror shows the rays that are mirrored by hand", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model const model = cloud(9, 200, {0, 0, 3}, 0.8f);
  gart::camera const view = camera_at({0.2, 0.1, 0}, 32, 24, 30);
  gart::render_options options;
  options.alpha_min = 1e-6f, options.transmittance_min = 0;
  light::scene scene;
  vec3 const middle(0, 0, 3.2f), u(4, 0, 1), v(0, -4, 0.5f);
  scene.meshes = {quad(middle, u, v, 0)};
  scene.materials = {material_of(light::material_kind::mirror, {1, 1, 1})};
  std::vector<float> const got = picture(exec, model, scene, view, options, through_middles(1));

  // The way to the mirror, then the mirrored one.
  vec3d const n = glm::normalize(glm::cross(vec3d(u), vec3d(v)));
  std::vector<float> none, to, ends, origins, back;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      vec3d const d = vec3d(gart::ray_direction(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
      double const t = glm::dot(n, vec3d(middle) - view.position) / glm::dot(n, d);
      vec3d const at = t * d, out = d - 2 * glm::dot(d, n) * n;
      for (int k = 0; k < 3; ++k) {
        to.push_back(static_cast<float>(d[k])), back.push_back(static_cast<float>(out[k]));
        origins.push_back(static_cast<float>(at[k]));
      }
      ends.push_back(static_cast<float>(t));
    }
  gart::gaussians<E> const there(exec, model);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(there.view(), model.sh_degree);
  batch_memory<E> const first(exec, view.position, none, to, ends), second(exec, view.position, origins, back);
  gart::render_options close = options;
  close.near = 1e-6f;
  auto const before = trace_all(exec, tracer, first.rays(), options),
             after = trace_all(exec, tracer, second.rays(), close);
  long wrong = 0;
  for (std::size_t i = 0; i < got.size(); ++i) {
    float const expected = before.color[i] + before.transmittance[i / 3] * after.color[i];
    wrong += std::fabs(got[i] - expected) > 1e-5f;
  }
  // Rays are off by a rounding, and thin Gaussians and those at the mirror see it.
  CHECK(wrong <= static_cast<long>(got.size() / 200));
}

TEST_CASE_TEMPLATE("a pane of glass shifts what is behind it by Snell's law", E, GART_TEST_POLICIES) {
  E exec;
  // A glowing plane behind a tilted pane: red grows with x from 0 to 1 over its width of 4, green is 1.
  light::scene scene;
  light::texture ramp;
  ramp.width = 64, ramp.height = 1, ramp.repeat_u = ramp.repeat_v = false;
  for (int i = 0; i < 64; ++i)
    for (float const x : {(static_cast<float>(i) + 0.5f) / 64, 1.0f, 0.0f, 1.0f}) ramp.texels.push_back(x);
  scene.textures = {ramp};
  light::material glow = glowing(vec3(1.0f)), glass = material_of(light::material_kind::dielectric);
  glow.emission_texture = 0, glass.ior = 1.5f;
  scene.materials = {glow, glass};
  float const tilt = 0.6f, thickness = 0.5f;
  vec3 const n(std::sin(tilt), 0, -std::cos(tilt)), across(std::cos(tilt), 0, std::sin(tilt)), middle(0, 0, 3);
  light::mesh const front = quad(middle, 3.0f * across, {0, -3, 0}, 1);
  light::mesh back = quad(middle - thickness * n, -3.0f * across, {0, -3, 0}, 1);
  scene.meshes = {quad({0, 0, 6}, {2, 0, 0}, {0, -2, 0}, 0), front, back};
  REQUIRE(glm::dot(glm::cross(across, vec3(0, -1, 0)), n) > 0.99f);
  gart::camera const view = camera_at({}, 9, 3, 60);
  // Two bounces lead through it without a reflection within.
  std::vector<float> const got = picture(exec, nothing(), scene, view, {}, through_middles(2), 64);
  for (int x = 0; x < 9; ++x) {
    CAPTURE(x);
    double const slope = (x + 0.5 - 4.5) / 60, angle = std::atan(slope);
    // In the plane of incidence: the angle with the pane's normal, turned by the tilt.
    double const in = angle + double{tilt}, bent = std::asin(std::sin(in) / 1.5);
    double const sideways = double{thickness} * std::sin(in - bent) / std::cos(bent);  // across the ray
    double const place = 6 * slope - sideways / std::cos(angle);
    float const* const c = got.data() + 3 * (9 + x);
    REQUIRE(c[1] > 0.5f);
    double const seen = 4 * double{c[0] / c[1]} - 2;
    // In pixels of the view.
    CHECK(60 * std::fabs(seen - place) / 6 < 1e-4);
  }
}

TEST_CASE_TEMPLATE("a penumbra is the part of the light that is seen", E, GART_TEST_POLICIES) {
  E exec;
  // A floor at y = 0 under a small ball of light at height 8; a half-plane at height 4 hides it where x < 0.
  light::scene scene;
  scene.materials = {matt(vec3(1.0f)), matt(vec3(0.0f))};
  scene.meshes = {quad({0, 0, 4}, {2, 0, 0}, {0, 0, 2}, 0), quad({-10, -4, 4}, {10, 0, 0}, {0, 0, 10}, 1)};
  float const radius = 0.2f;
  light::light ball_of_light;
  ball_of_light.kind = light::light_kind::sphere, ball_of_light.position = {0, -8, 4};
  ball_of_light.radius = radius, ball_of_light.color = vec3(100.0f);
  scene.lights = {ball_of_light};
  gart::camera view = camera_at({0, -2, 4}, 24, 1, 60);
  view.rotation = gart::mat3(vec3(1, 0, 0), vec3(0, 0, -1), vec3(0, 1, 0));  // down
  std::vector<float> const got = picture(exec, nothing(), scene, view, {}, through_middles(1), 256);
  for (int x = 0; x < 24; ++x) {
    CAPTURE(x);
    double const at = 2 * (x + 0.5 - 12) / 60;
    // The edge cuts the light's disk at x = -at, by similar triangles about the edge half way up.
    double const cut = std::clamp(at / double{radius}, -1.0, 1.0);
    double const part = 1 - (std::acos(cut) - cut * std::sqrt(1 - cut * cut)) / 3.141592653589793;
    double const d2 = 64 + at * at, whole = 100 * double{radius * radius} / d2 * 64 / d2;
    CHECK(double{got[static_cast<std::size_t>(3 * x)]} == doctest::Approx(whole * part).scale(whole).epsilon(0.01));
  }
}

TEST_CASE_TEMPLATE("light that is aimed at has the mean of light that is met", E, GART_TEST_POLICIES) {
  E exec;
  light::scene scene;
  scene.meshes = {quad({0, 1, 4}, {2, 0, 0}, {0, 0, 2}, 0), ball({0.3f, 0.4f, 4}, 0.5f, 0, 12, true)};
  scene.materials = {material_of(light::material_kind::surface, {0.8f, 0.7f, 0.6f})};
  scene.materials[0].roughness = 0.35f;
  gart::camera const view = camera_at({0, -0.5, 0}, 16, 12, 14);
  light::path_options paths = through_middles(2);
  // An environment with a bright spot, by its table and as a mesh of glowing quads would be: a constant one is met
  // only.
  scene.around.color = vec3(1.0f), scene.around.width = 32, scene.around.height = 16;
  for (int i = 0; i < 32 * 16; ++i)
    for (int k = 0; k < 3; ++k) scene.around.texels.push_back(1.0f);
  scene.around.to_image = gart::mat3(vec3(1, 0, 0), vec3(0, -1, 0), vec3(0, 0, -1));
  vec3d const aimed = mean_of(picture(exec, nothing(), scene, view, {}, paths, 64));
  scene.around = {};
  scene.around.color = vec3(1.0f);
  vec3d const met = mean_of(picture(exec, nothing(), scene, view, {}, paths, 64));
  CHECK(aimed.x == doctest::Approx(met.x).epsilon(0.005));
  // A rectangle that shines, and a quad that glows.
  scene.around = {};
  light::light shining;
  shining.kind = light::light_kind::rectangle, shining.color = vec3(5.0f);
  shining.position = {-0.5f, -1, 3.5f}, shining.edge_u = {1, 0, 0}, shining.edge_v = {0, 0, 1};
  REQUIRE(glm::cross(shining.edge_u, shining.edge_v).y < 0);
  shining.edge_v = {0, 0, -1};  // down
  scene.lights = {shining};
  vec3d const by_light = mean_of(picture(exec, nothing(), scene, view, {}, paths, 128));
  scene.lights = {};
  scene.materials.push_back(glowing(vec3(5.0f)));
  scene.meshes.push_back(quad(shining.position, {0.5f, 0, 0}, {0, 0, 0.5f}, 1));
  vec3d const by_mesh = mean_of(picture(exec, nothing(), scene, view, {}, paths, 1024));
  CHECK(by_light.y == doctest::Approx(by_mesh.y).epsilon(0.02));
  // What roulette ends is made up for by what it lets pass.
  paths.bounces = 8, paths.roulette_after = 64;
  scene.around.color = vec3(0.5f);
  vec3d const whole = mean_of(picture(exec, nothing(), scene, view, {}, paths, 128));
  paths.roulette_after = 0;
  vec3d const ended = mean_of(picture(exec, nothing(), scene, view, {}, paths, 128));
  CHECK(ended.y == doctest::Approx(whole.y).epsilon(0.01));
}

TEST_CASE_TEMPLATE("what the camera moves by blurs, what is in focus is sharp", E, GART_TEST_POLICIES) {
  // The edge of a glowing half-plane at distance 4: where it stands, moved, and out of focus.
  E exec;
  light::scene scene;
  scene.meshes = {quad({-5, 0, 4}, {5, 0, 0}, {0, -5, 0}, 0)};
  scene.materials = {glowing(vec3(1.0f))};
  gart::camera view = camera_at({}, 64, 1, 64);
  auto const row = [&](light::path_options const& paths) {
    return picture(exec, nothing(), scene, view, {}, paths, 256);
  };
  light::path_options paths = through_middles(0);
  auto const sharp = row(paths);
  for (int x = 0; x < 64; ++x) CHECK(sharp[static_cast<std::size_t>(3 * x)] == (x < 32 ? 1.0f : 0.0f));
  // By one unit, 16 pixels: the edge is anywhere within 8 pixels of where it was, equally long.
  view.travel = {1, 0, 0}, paths.blur = 1;
  auto const moved = row(paths);
  for (int x = 0; x < 64; ++x)
    CHECK(moved[static_cast<std::size_t>(3 * x)] ==
          doctest::Approx(std::clamp((40 - (x + 0.5)) / 16, 0.0, 1.0)).scale(1).epsilon(0.02));
  // A lens of radius 0.5: at the focus as without, at twice the distance of it a disk of 8 pixels' radius.
  view.travel = vec3(0.0f), paths.blur = 0, paths.aperture = 0.5f, paths.focus = 4;
  auto const focused = row(paths);
  for (int x = 0; x < 64; ++x)
    if (x != 31 && x != 32)
      CHECK(focused[static_cast<std::size_t>(3 * x)] == doctest::Approx(x < 32 ? 1 : 0).scale(1).epsilon(1e-5));
  paths.focus = 2;
  auto const soft = row(paths);
  for (int x = 0; x < 64; ++x) {
    double const cut = std::clamp((x + 0.5 - 32) / 8, -1.0, 1.0);
    double const part = (std::acos(cut) - cut * std::sqrt(1 - cut * cut)) / 3.141592653589793;
    CHECK(soft[static_cast<std::size_t>(3 * x)] == doctest::Approx(part).scale(1).epsilon(0.02));
  }
}

TEST_CASE_TEMPLATE("a Gaussian cut by a surface counts whole or not at all", E, GART_TEST_POLICIES) {
  // Against its density marched along the ray in double up to the surface: off by 1 - sqrt(1 - alpha) at most, where
  // the surface goes through its middle, and by nothing far from it.
  E exec;
  gart::gaussian_model model = cloud(1, 1, {0, 0, 4}, 0, false, 0);
  float const scale = 0.1f, alpha = 0.8f;
  model.log_scale.assign(3, std::log(scale));
  model.opacity[0] = std::log(alpha / (1 - alpha));
  light::scene scene;
  scene.materials = {glowing(vec3(1.0f))};
  gart::camera const view = camera_at({}, 1, 1, 100);
  double worst = 0;
  for (int i = -20; i <= 20; ++i) {
    double const at = 4 + 0.02 * (i + 0.5);
    scene.meshes = {quad({0, 0, static_cast<float>(at)}, {1, 0, 0}, {0, -1, 0}, 0)};
    double const seen = double{picture(exec, model, scene, view, {}, through_middles(0))[0]};
    // Density whose whole is -ln(1 - alpha), a normal along the ray.
    double depth = 0;
    int const steps = 20000;
    for (int k = 0; k < steps; ++k) {
      double const z = at * (k + 0.5) / steps, off = (z - 4) / double{scale};
      depth += at / steps * std::exp(-0.5 * off * off) / (double{scale} * std::sqrt(6.283185307179586));
    }
    double const difference = std::fabs(seen - std::pow(1 - double{alpha}, depth));
    worst = std::max(worst, difference);
    if (std::abs(i) > 17) CHECK(difference < 2e-3);
  }
  CHECK(worst < 1 - std::sqrt(1 - double{alpha}));
  CHECK(worst > 0.8 * (1 - std::sqrt(1 - double{alpha})));
}

TEST_CASE("numbers are drawn evenly, and so are angles") {
  using namespace gart::light_kernels;
  for (u32 const use : {0u, 3u, 17u}) {
    int cells[16][16] = {};
    for (u32 s = 0; s < 256; ++s) {
      gart::vec2 const p = draws::of(5, 77, s).pair(2, use);
      ++cells[static_cast<int>(p.x * 16)][static_cast<int>(p.y * 16)];
    }
    for (auto const& row : cells)
      for (int const n : row) CHECK(n == 1);
  }
  double worst = 0;
  for (int i = 0; i < 10000; ++i) {
    float const u = static_cast<float>(i) / 10000;
    double const angle = 6.283185307179586 * double{u};
    gart::vec2 const turn = turn_of(u);
    worst = std::max({worst, std::fabs(double{turn.x} - std::cos(angle)), std::fabs(double{turn.y} - std::sin(angle))});
    double const back = std::fabs(double{turns_of(turn.x, turn.y) - u});
    worst = std::max(worst, 6.28 * std::min(back, 1 - back));
  }
  CHECK(worst < 2e-6);
}

TEST_CASE_TEMPLATE("an environment is aimed at where it is bright", E, GART_TEST_POLICIES) {
  // A floor under one bright texel, against the sum over its solid angle.
  E exec;
  light::scene scene;
  scene.meshes = {quad({0, 1, 4}, {2, 0, 0}, {0, 0, 2}, 0)};
  scene.materials = {matt(vec3(1.0f))};
  int const w = 64, h = 32, bx = 20, by = 5;
  scene.around.color = vec3(1.0f), scene.around.width = w, scene.around.height = h;
  scene.around.to_image = gart::mat3(vec3(1, 0, 0), vec3(0, -1, 0), vec3(0, 0, -1));  // y down: up is -y
  scene.around.texels.assign(static_cast<std::size_t>(3 * w * h), 0.0f);
  for (std::size_t k = 0; k < 3; ++k) scene.around.texels[static_cast<std::size_t>(3 * (by * w + bx)) + k] = 1000;
  // Bilinear: a tent about the texel; the irradiance of the floor by a fine sum.
  double expected = 0;
  int const fine = 40;
  double const pi = 3.141592653589793;
  for (int j = -fine; j < fine; ++j)
    for (int i = -fine; i < fine; ++i) {
      double const fx = (i + 0.5) / fine, fy = (j + 0.5) / fine, theta = pi * (by + 0.5 + fy) / h;
      double const solid = 2 * pi / w * pi / h * std::sin(theta) / (fine * fine);
      expected += 1000 * (1 - std::fabs(fx)) * (1 - std::fabs(fy)) * std::cos(theta) * solid / pi;
    }
  gart::camera view = camera_at({0, 0, 4}, 4, 4, 16);
  view.rotation = gart::mat3(vec3(1, 0, 0), vec3(0, 0, -1), vec3(0, 1, 0));
  vec3d const got = mean_of(picture(exec, nothing(), scene, view, {}, through_middles(1), 2048));
  CHECK(got.x == doctest::Approx(expected).epsilon(0.03));
}
