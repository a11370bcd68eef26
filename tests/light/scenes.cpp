// Small scenes against light by definition, in double: whatever is met, in whatever order, on every policy.
#include <gart/camera/models.hpp>
#include <gart/render/frame.hpp>
#include <gart/trace/bvh_tracer.hpp>

#include <light/double_light.hpp>
#include <light/small_scenes.hpp>
#include <rays/view_rays.hpp>

using namespace gart_test;

namespace {

struct case_of_light {
  char const* name;
  gart::gaussian_model model;
  light::scene scene;
  light::path_options paths;
};

light::texture checks(int side) {
  light::texture t;
  t.width = side, t.height = side;
  for (int i = 0; i < side * side; ++i)
    for (float const x : {0.2f + 0.1f * static_cast<float>(i % 7), i % 2 ? 0.9f : 0.3f, 0.5f, 1.0f})
      t.texels.push_back(x);
  return t;
}

// Seen from the origin along +z, y down.
std::vector<case_of_light> small_cases() {
  using enum light::material_kind;
  std::vector<case_of_light> all;
  gart::gaussian_model const shown = cloud(5, 60, {0, 0, 4}, 0.7f), black = cloud(6, 60, {0, 0, 4}, 0.7f, false);
  light::mesh const floor = quad({0, 1.1f, 4}, {3, 0, 0}, {0, 0, 3}, 0),
                    wall = quad({0.2f, 0, 4.3f}, {1.5f, 0, 0.6f}, {0, -1.2f, 0.3f}, 0),
                    blocker = quad({0.3f, -1.4f, 3.8f}, {0.6f, 0, 0}, {0, 0.1f, 0.7f}, 1);
  {
    case_of_light c{"a glowing wall among Gaussians", shown, {}, through_middles(0)};
    c.scene.meshes = {wall}, c.scene.materials = {glowing({0.9f, 0.7f, 0.4f})};
    c.scene.textures = {checks(5)}, c.scene.materials[0].emission_texture = 0;
    all.push_back(c);
  }
  {
    case_of_light c{"a mirror among Gaussians", shown, {}, through_middles(1)};
    c.scene.meshes = {wall}, c.scene.materials = {material_of(mirror, {0.9f, 0.8f, 0.7f})};
    all.push_back(c);
  }
  {
    case_of_light c{"mirrors in a corner", shown, {}, through_middles(6)};
    c.scene.meshes = {quad({1.2f, 0, 4.5f}, {1, 0, -1}, {0, -2, 0}, 0),
                      quad({-1.2f, 0, 4.5f}, {1, 0, 1}, {0, -2, 0}, 0)};
    c.scene.materials = {material_of(mirror, {0.9f, 0.8f, 0.7f})};
    c.paths.linear = true;
    all.push_back(c);
  }
  {
    case_of_light c{"shadows of Gaussians on a floor", black, {}, through_middles(1)};
    c.scene.meshes = {floor, blocker}, c.scene.materials = {matt({0.8f, 0.6f, 0.5f}), matt(vec3(0.0f))};
    c.scene.lights = {sun({0.2f, 1, 0.1f}, {2, 2, 1.5f}), point_light({-0.5f, -2, 3}, {4, 5, 6})};
    all.push_back(c);
  }
  for (auto const shadows : {light::shadow_kind::per_hit, light::shadow_kind::per_gaussian})
    for (bool const relight : {false, true}) {
      case_of_light c{"shadows of a mesh on Gaussians", shown, {}, through_middles(0)};
      c.scene.meshes = {blocker}, c.scene.materials = {matt(vec3(0.5f)), matt(vec3(0.0f))};
      c.scene.lights = {sun({0.2f, 1, 0.1f}, {2, 2, 1.5f}), point_light({-0.5f, -2, 3}, {4, 5, 6})};
      c.paths.shadows = shadows, c.paths.relight = relight, c.paths.ambient = 0.2f, c.paths.linear = relight;
      all.push_back(c);
    }
  {
    case_of_light c{"a floor that catches shadows", shown, {}, through_middles(1)};
    c.scene.meshes = {floor, blocker}, c.scene.materials = {material_of(shadow_catcher), glowing({0.3f, 0.1f, 0})};
    c.scene.lights = {sun({0.2f, 1, 0.1f}, {2, 2, 1.5f})};
    c.scene.around.color = {0.4f, 0.5f, 0.6f};
    all.push_back(c);
  }
  {
    case_of_light c{"a tinted pane that bends nothing", shown, {}, through_middles(3)};
    c.scene.meshes = {quad({0, 0, 3.9f}, {1, 0, 0.2f}, {0, -1, 0.1f}, 0)};
    c.scene.materials = {material_of(dielectric, {0.9f, 0.5f, 0.3f})};
    c.scene.materials[0].ior = 1;
    all.push_back(c);
  }
  {  // Glass from within: all is reflected where the far side is seen at more than 41.8 degrees.
    case_of_light c{"total reflection", shown, {}, through_middles(1)};
    c.scene.meshes = {quad({0, 0, 4}, {0.5f, 0, 3}, {0, -2, 0}, 0)};
    c.scene.materials = {material_of(dielectric)};
    c.scene.materials[0].ior = 1.5f;
    c.scene.meshes[0].triangles = {0, 2, 1, 0, 3, 2};
    all.push_back(c);
  }
  return all;
}

std::vector<double> defined(case_of_light const& c, gart::camera const& view, gart::render_options const& options) {
  double_light const light(c.model, c.scene, options, c.paths);
  std::vector<double> out;
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x) {
      gart::ray const r = gart::ray_through(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      vec3d const c = light(view.position + vec3d(r.origin), glm::normalize(vec3d(r.direction)));
      for (int k = 0; k < 3; ++k) out.push_back(c[k]);
    }
  return out;
}

}  // namespace

TEST_CASE_TEMPLATE("pictures are those by definition", E, GART_TEST_POLICIES) {
  E exec;
  gart::render_options options;
  // No steps where double and float could disagree.
  options.alpha_min = 1e-7f, options.transmittance_min = 0;
  options.background = vec3(0.2f, 0.3f, 0.1f);
  gart::camera const view = camera_at({0.1, -0.05, 0});
  for (case_of_light const& c : small_cases()) {
    CAPTURE(c.name);
    CAPTURE(gart::to_string(c.paths.shadows));
    CAPTURE(c.paths.relight);
    std::vector<float> const got = picture(exec, c.model, c.scene, view, options, c.paths);
    std::vector<double> const expected = defined(c, view, options);
    REQUIRE(got.size() == expected.size());
    double sum = 0;
    long wrong = 0, edges = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
      double const difference = std::fabs(double{got[i]} - expected[i]);
      wrong += difference > 1e-4;
      edges += difference > 1e-2;
      sum += expected[i];
    }
    // A pixel's ray may pass an edge on its other side by a rounding.
    CHECK(wrong <= 3);
    CHECK(edges <= 3);
    CHECK(sum > 20);
  }
}

TEST_CASE_TEMPLATE("Gaussians alone are what a renderer shows", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model const model = cloud(8, 300, {0, 0, 4}, 0.8f);
  gart::camera view = camera_at({0.3, -0.2, 0.5}, 40, 30, 30);
  gart::render_options options;
  options.background = vec3(0.3f, 0.2f, 0.6f);
  for (float const k1 : {0.0f, 0.1f}) {
    view.lens.k1 = k1;
    auto const expected = trace_view<gart::bvh_tracer<E>>(exec, model, view, options, 2).color;
    CHECK(picture(exec, model, {}, view, options, through_middles(3)) == expected);
  }
}

TEST_CASE_TEMPLATE("samples are the same whatever they are added by", E, GART_TEST_POLICIES) {
  E exec;
  auto const c = small_cases()[3];
  gart::camera const view = camera_at({0.1, -0.05, 0});
  light::path_options paths = c.paths;
  paths.jitter = true, paths.bounces = 3, paths.aperture = 0.05f, paths.focus = 4, paths.seed = 7;
  gart::gaussians<E> const there(exec, c.model);
  gart::path_tracer<E> tracer(exec);
  tracer.set_model(there.view(), c.model.sh_degree), tracer.set_scene(c.scene);
  tracer.begin(view, {}, paths);
  tracer.add(6);
  auto const at_once = tracer.sums().to_host();
  tracer.begin(view, {}, paths);
  tracer.add(1), tracer.add(3), tracer.add(2);
  CHECK(tracer.samples() == 6);
  CHECK(tracer.sums().to_host() == at_once);
  paths.seed = 8;
  tracer.begin(view, {}, paths);
  tracer.add(6);
  CHECK(tracer.sums().to_host() != at_once);
}

TEST_CASE_TEMPLATE("first segments by tiles are those by the tree", E, GART_TEST_POLICIES) {
  E exec;
  gart::camera view = camera_at({0.1, -0.05, 0}, 40, 29, 30);
  auto cases = small_cases();
  cases.resize(5);
  for (auto& c : cases) {
    gart::gaussians<E> const there(exec, c.model);
    std::vector<float> sums[2];
    for (bool const jitter : {false, true})
      for (float const k1 : {0.0f, 0.1f}) {
        c.paths.jitter = jitter, view.lens.k1 = k1;
        for (auto const by : {gart::first_hits::tree, gart::first_hits::tiles}) {
          gart::path_tracer<E> tracer(exec);
          tracer.find_first(by);
          tracer.set_model(there.view(), c.model.sh_degree), tracer.set_scene(c.scene);
          tracer.begin(view, {}, c.paths);
          tracer.add(3);
          sums[by == gart::first_hits::tiles] = tracer.sums().to_host();
        }
        CHECK(sums[0] == sums[1]);
      }
  }
}

// Samples of one pixel fill it: an edge through its middle is half of it.
TEST_CASE_TEMPLATE("jitter fills the pixels", E, GART_TEST_POLICIES) {
  E exec;
  light::scene scene;
  scene.meshes = {quad({10, 0, 4}, {10, 0, 0}, {0, 10, 0}, 0)};
  scene.materials = {glowing(vec3(1.0f))};
  gart::gaussian_model const none = cloud(1, 1, {0, 0, -5}, 0.1f);
  light::path_options paths = through_middles(0);
  paths.jitter = true;
  for (float const k1 : {0.0f, 1e-6f}) {  // all pixels together, each by itself
    gart::camera view = camera_at({0, 0, 0}, 9, 5, 20);
    view.cx = 4.75f, view.lens.k1 = k1;  // the edge is at 4.75
    auto const seen = picture(exec, none, scene, view, {}, paths, 64);
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x)
        CHECK(double{seen[static_cast<std::size_t>(3 * (9 * y + x))]} == doctest::Approx(x < 4   ? 0.0
                                                                                         : x > 4 ? 1.0
                                                                                                 : 0.25)
                                                                             .epsilon(0.03)
                                                                             .scale(1.0));
  }
}

#if !defined(GART_TEST_CUDA)
TEST_CASE("policies of hosts draw the same bits") {
  gart::serial_exec serial;
  gart::openmp_exec openmp(2);
  gart::camera const view = camera_at({0.1, -0.05, 0});
  for (auto c : small_cases()) {
    c.paths.jitter = true, c.paths.bounces = 4;
    c.scene.around.color = vec3(0.5f);
    for (auto& m : c.scene.materials) m.ior = 1.4f, m.roughness = 0.4f;
    CHECK(picture(serial, c.model, c.scene, view, {}, c.paths, 3) ==
          picture(openmp, c.model, c.scene, view, {}, c.paths, 3));
  }
}
#endif
