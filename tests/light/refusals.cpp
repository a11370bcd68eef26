// What is refused, by the field that is wrong; and the run-time interface.
#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>
#include <gart/runtime/path_renderer.hpp>

#include <light/small_scenes.hpp>
#include <support/refused.hpp>

#include <limits>

using namespace gart_test;

namespace {

light::scene sound() {
  light::scene s;
  s.meshes = {quad({0, 0, 3}, {1, 0, 0}, {0, 1, 0}, 0)};
  s.meshes[0].name = "wall";
  s.materials = {matt(vec3(0.5f))};
  s.textures.resize(1);
  s.textures[0].width = s.textures[0].height = 2, s.textures[0].texels.assign(16, 1.0f);
  s.lights = {sun({0, 0, 1}, vec3(1.0f)), point_light({0, 0, 0}, vec3(1.0f))};
  return s;
}

}  // namespace

TEST_CASE("scenes that cannot be traced are refused by the field") {
  CHECK_NOTHROW(light::require_scene(sound()));
  CHECK_NOTHROW(light::require_scene({}));
  float const nan = std::numeric_limits<float>::quiet_NaN();
  auto const with = [](auto&& change) {
    return [change] {
      light::scene s = sound();
      change(s);
      light::require_scene(s);
    };
  };
  using light::scene;
  refused(with([](scene& s) { s.meshes[0].triangles[4] = 9; }),
          "light::scene.meshes[0] ('wall').triangles names corner 9 in triangle 1, and there are 4 positions");
  refused(with([](scene& s) { s.meshes[0].triangles.pop_back(); }), "triangles is no multiple of three");
  refused(with([&](scene& s) { s.meshes[0].positions[2].y = nan; }), "positions[2] is not finite");
  refused(with([](scene& s) { s.meshes[0].normals.resize(3); }), "normals has 3 entries, and 4 positions");
  refused(with([](scene& s) { s.meshes[0].uvs.resize(3); }), "uvs has 3 entries");
  refused(with([](scene& s) { s.meshes[0].triangle_material[1] = 1; }), "names material 1, and there are 1");
  refused(with([](scene& s) { s.materials.clear(); }), "materials is empty");
  refused(with([](scene& s) { s.materials[0].roughness = 1.5f; }), "roughness is 1.5");
  refused(with([](scene& s) { s.materials[0].ior = 0.5f; }), "ior is 0.5");
  refused(with([](scene& s) { s.materials[0].base_color_texture = 1; }), "base_color_texture is 1, and there are 1");
  refused(with([](scene& s) { s.materials[0].emission.x = -1; }), "emission must be finite");
  refused(with([](scene& s) { s.textures[0].texels.pop_back(); }), "texels has 15 entries, and 4 texels of four");
  refused(with([](scene& s) { s.textures[0].width = 0; }), "textures[0] is 0 x 2");
  refused(with([](scene& s) { s.lights[0].direction = vec3(0.0f); }), "lights[0].direction has no length");
  refused(with([](scene& s) { s.lights[0].angle = 2; }), "angle is 2");
  refused(with([&](scene& s) { s.lights[1].position.x = nan; }), "lights[1].position is not finite");
  refused(with([](scene& s) { s.lights[1].kind = light::light_kind::sphere; }), "radius is 0");
  refused(with([](scene& s) {
            s.lights[1].kind = light::light_kind::rectangle, s.lights[1].edge_v = {1, 1, 0};
          }),
          "edge_v is not at right angles");
  refused(with([](scene& s) { s.around.to_image[0][0] = 2; }), "around.to_image is no rotation");
  refused(with([](scene& s) { s.around.width = s.around.height = 2; }), "around.texels has 0 entries");
}

TEST_CASE("options that nothing is traced by are refused by name") {
  auto const with = [](auto&& change) {
    return [change] {
      light::path_options o;
      change(o);
      light::require_path_options(o);
    };
  };
  using light::path_options;
  refused(with([](path_options& o) { o.samples = 0; }), "path_options.samples must be 1 or more, not 0");
  refused(with([](path_options& o) { o.bounces = 65; }), "path_options.bounces");
  refused(with([](path_options& o) { o.ambient = 2; }), "path_options.ambient");
  refused(with([](path_options& o) { o.aperture = -1; }), "path_options.aperture");
  refused(with([](path_options& o) { o.focus = 0; }), "path_options.focus");
  refused(with([](path_options& o) { o.blur = 2; }), "path_options.blur");
  refused(with([](path_options& o) { o.firefly = -1; }), "path_options.firefly");
}

TEST_CASE("a renderer of paths adds samples to a picture") {
  gart::configuration_request request;
  request.backend = gart::backend_kind::openmp, request.threads = 2;
  auto const renderer = gart::make_path_renderer(request);
  CHECK(renderer->configuration().backend == gart::backend_kind::openmp);
  gart::camera const view = camera_at({}, 12, 8, 10);
  gart::gaussian_model const model = cloud(3, 30, {0, 0, 2}, 0.4f);
  refused([&] { renderer->begin(view, {}, {}); }, "there are no Gaussians");
  renderer->set_model(model);
  refused([&] { renderer->begin(view, {}, {}); }, "there is no scene");
  renderer->set_scene(sound());
  refused([&] { renderer->add(1); }, "call begin first");
  gart::render_options filtered;
  filtered.antialias = 0.3f;
  refused([&] { renderer->begin(view, filtered, {}); }, "render_options.antialias");
  light::path_options paths = through_middles(2);
  paths.jitter = true, paths.exposure = 1, paths.tone = light::tone_kind::srgb;
  renderer->begin(view, {}, paths);
  refused([&] { renderer->radiance(); }, "there is no sample");
  renderer->add(2), renderer->add(3);
  CHECK(renderer->samples() == 5);
  gart::serial_exec exec;
  std::vector<float> const expected = picture(exec, model, sound(), view, {}, paths, 5);
  gart::image_float const got = renderer->radiance(), shown = renderer->picture();
  REQUIRE(got.data.size() == expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i) {
    CHECK(got.data[i] == doctest::Approx(expected[i]).epsilon(1e-6));
    float const x = std::min(2 * got.data[i], 1.0f);
    CHECK(shown.data[i] ==
          doctest::Approx(x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1 / 2.4f) - 0.055f).epsilon(1e-5));
  }
  CHECK(renderer->picture_8bit().data == gart::to_8bit(shown).data);
  paths.tone = light::tone_kind::filmic, paths.exposure = -1;
  renderer->begin(view, {}, paths);
  renderer->add(5);
  gart::image_float const filmic = renderer->picture();
  for (std::size_t i = 0; i < expected.size(); ++i) {
    double const x = 0.5 * double{expected[i]}, y = x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
    CHECK(filmic.data[i] ==
          doctest::Approx(y <= 0.0031308 ? 12.92 * y : 1.055 * std::pow(y, 1 / 2.4) - 0.055).epsilon(1e-4));
  }

  // The layers: the wall behind the Gaussians.
  gart::path_layers const layers = renderer->layers();
  std::size_t const middle = 4 * 12 + 6;
  CHECK(layers.mesh.data[middle] == 0);
  CHECK(layers.triangle.data[middle] < 2);
  CHECK(layers.mesh.data[0] == gart::no_number);
  float const left = layers.transmittance.data[middle];
  CHECK(left < 1);
  CHECK(layers.gaussian.data[middle] != gart::no_number);
  CHECK(layers.normal.data[3 * middle + 2] == doctest::Approx(-left));
  CHECK(layers.depth.data[middle] > 1);
  CHECK(layers.depth.data[middle] < 3.5f);
  CHECK(renderer->samples() == 5);

  request.kernel_degree = 7;
  CHECK_THROWS_WITH_AS(gart::make_path_renderer(request), doctest::Contains("kernel degree 7; there are: "),
                       gart::unsupported);
}
