// Scenes of meshes and lights in a viewer: samples that add up are those of a path renderer, and what is changed is
// what a scene.json of the changes says.
#include "cameras.hpp"

#include <clients.hpp>

#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>
#include <gart/view/edited_scene.hpp>
#include <gart/view/path_view.hpp>

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <unistd.h>
#include <array>
#include <cmath>
#include <fstream>
#include <random>

namespace {

namespace fs = std::filesystem;
using gart::vec3;
using nlohmann::json;

struct folder {
  fs::path path = fs::temp_directory_path() / ("gart_view_" + std::to_string(::getpid()));
  folder() { fs::create_directories(path); }
  ~folder() { fs::remove_all(path); }
  fs::path write(std::string const& name, std::string const& text) const {
    std::ofstream(path / name) << text;
    return path / name;
  }
};

char const* const two_things = R"({
  "materials": [{"name": "steel", "kind": "mirror"}],
  "meshes": [{"name": "ball", "shape": "sphere", "translation": [1, 0, 0], "scale": 0.5, "material": "steel"},
             {"shape": "box"}],
  "lights": [{"name": "lamp", "kind": "point", "position": [0, -3, 0], "color": [4, 4, 4]},
             {"kind": "directional", "direction": [0, 2, 0]}],
  "options": {"samples": 3, "bounces": 2}})";

gart::gaussian_model cloud() {
  std::mt19937_64 engine(3);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(20, 0);
  for (auto& x : m.mean) x = 0.5f * normal(engine);
  for (auto& x : m.log_scale) x = -1.5f;
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.sh) x = normal(engine);
  return m;
}

std::unique_ptr<gart::path_renderer> serial(gart::light::scene const& scene) {
  gart::configuration_request r;
  r.backend = gart::backend_kind::serial;
  auto by = gart::make_path_renderer(r);
  by->set_scene(scene);
  return by;
}

// The same scene, whatever way it was made.
void check_same(gart::light::scene const& a, gart::light::scene const& b) {
  REQUIRE(a.meshes.size() == b.meshes.size());
  for (std::size_t m = 0; m < a.meshes.size(); ++m) {
    REQUIRE(a.meshes[m].positions.size() == b.meshes[m].positions.size());
    for (std::size_t i = 0; i < a.meshes[m].positions.size(); ++i)
      for (int k = 0; k < 3; ++k)
        CHECK(a.meshes[m].positions[i][k] == doctest::Approx(b.meshes[m].positions[i][k]).epsilon(1e-5));
    REQUIRE(a.meshes[m].normals.size() == b.meshes[m].normals.size());
    for (std::size_t i = 0; i < a.meshes[m].normals.size(); ++i)
      CHECK(glm::dot(a.meshes[m].normals[i], b.meshes[m].normals[i]) > 0.99999f);
    CHECK(a.meshes[m].triangles == b.meshes[m].triangles);
    CHECK(a.materials[a.meshes[m].triangle_material[0]].kind == b.materials[b.meshes[m].triangle_material[0]].kind);
  }
  REQUIRE(a.lights.size() == b.lights.size());
  for (std::size_t l = 0; l < a.lights.size(); ++l) {
    CHECK(a.lights[l].position == b.lights[l].position);
    CHECK(a.lights[l].direction == b.lights[l].direction);
    CHECK(a.lights[l].color == b.lights[l].color);
  }
}

struct edited {
  folder in;
  fs::path file = in.write("scene.json", two_things);
  gart::vec3d origin{10, 0, 0};
  gart::edited_scene scene{file, gart::read_scene(file, origin), origin, {}, vec3(0.0f), 2.0f};
  gart::light::scene saved() const { return gart::read_scene(in.write("saved.json", scene.text()), origin).scene; }
  void change(gart::part_edit const& e) {
    scene.change(e);
    check_same(scene.scene(), saved());
  }
};

}  // namespace

TEST_CASE("a moving view is one sample, at rest samples add up") {
  folder const in;
  gart::scene_file const file = gart::read_scene(in.write("scene.json", two_things));
  gart::gaussian_model const m = cloud();
  auto const shown = serial(file.scene), alone = serial(file.scene);
  gart::render_options options;
  options.background = vec3(0.2f, 0.3f, 0.4f);
  gart::view_render const render = gart::render_of(*shown, m, options, file.paths);
  alone->set_model(m);
  gart::camera const view = gart_test::camera_at({0, 0, -4}, 0, 24, 16);
  auto const expected = [&](int bounces, int samples) {
    gart::light::path_options paths = file.paths;
    paths.bounces = bounces;
    alone->begin(view, options, paths);
    alone->add(samples);
    return gart::to_8bit(alone->picture()).data;
  };
  gart::view_settings settings;
  settings.effort = gart::view_effort::draft;
  CHECK(render.colours(view, settings).data == expected(1, 1));
  CHECK(render.samples() == std::pair{1, 3});
  settings.effort = gart::view_effort::begun;
  auto picture = render.colours(view, settings);
  settings.effort = gart::view_effort::more;
  while (render.samples().first < 3) {
    CHECK(picture.data == expected(2, render.samples().first));
    picture = render.colours(view, settings);
  }
  CHECK(render.samples() == std::pair{3, 3});
  CHECK(picture.data == expected(2, 3));
  // Behind a surface nothing is seen; where there is none, what the Gaussians leave.
  gart::rendered const r = render.images(view, {});
  auto const layers = alone->layers();
  bool surface = false, open = false;
  for (std::size_t i = 0; i < layers.mesh.data.size(); ++i) {
    bool const on = layers.mesh.data[i] != gart::no_number;
    (on ? surface : open) = true;
    CHECK(r.transmittance.data[i] == (on ? 0 : layers.transmittance.data[i]));
  }
  CHECK((surface && open));
  // Without Gaussians, by a crop box, meshes are still there.
  settings.effort = gart::view_effort::draft;
  settings.crop = gart::view_box{vec3(50.0f), vec3(60.0f)};
  auto const cropped = render.colours(view, settings);
  alone->set_model(gart::cropped(m, *settings.crop));
  CHECK(cropped.data == expected(1, 1));
}

TEST_CASE("parts of a scene are listed, moved and changed") {
  edited e;
  auto const parts = e.scene.parts();
  REQUIRE(parts.size() == 4);
  CHECK(parts[0].name == "ball");
  CHECK(parts[0].kind == "own");
  CHECK(parts[0].place.x == doctest::Approx(-9));
  CHECK(parts[0].low.y == doctest::Approx(-0.5));
  CHECK(parts[1].name == "box");
  CHECK((parts[2].light && parts[2].name == "lamp" && parts[2].kind == "point"));
  CHECK(parts[2].place == vec3(-10, -3, 0));
  CHECK(parts[2].color == vec3(4.0f));
  CHECK(parts[3].place.y < -1);  // it shines down, from above
  e.change({.index = 0, .place = vec3(-8, 1, 2)});
  CHECK(e.scene.parts()[0].place.y == doctest::Approx(1));
  CHECK(e.scene.parts()[1].place.y == doctest::Approx(0));
  for (char const* kind : {"dielectric", "surface", "shadow_catcher", "mirror", "own"}) {
    for (int index : {0, 1}) e.change({.index = index, .material = kind});
    CHECK(e.scene.parts()[0].kind == kind);
    CHECK(e.scene.parts()[1].kind == kind);
  }
  CHECK(e.scene.scene().materials[e.scene.scene().meshes[0].triangle_material[0]].name == "steel");
  CHECK(e.scene.parts()[0].place.z == doctest::Approx(2));  // where it was moved to
  e.change({.index = 2, .place = vec3(1, 2, 3), .color = vec3(1, 0, 0.5f)});
  CHECK(e.scene.parts()[2].place == vec3(1, 2, 3));
  e.change({.index = 3, .place = vec3(5, 0, 0)});
  CHECK(e.scene.scene().lights[1].direction.x < 0);
  CHECK_THROWS_AS(e.scene.change({.index = 4}), gart::invalid_argument);
}

TEST_CASE("a mesh is turned and made larger about a point") {
  edited e;
  double const half = std::sqrt(0.5);
  // A quarter about z, through a point a unit before the ball.
  e.change({.index = 0, .rotation = {{half, 0, 0, half}}, .about = vec3(-10, 0, 0)});
  auto ball = e.scene.parts()[0];
  CHECK(std::fabs(ball.place.x + 10) < 1e-5);
  CHECK(ball.place.y == doctest::Approx(1));
  CHECK(ball.rotation[3] == half);
  // Longer along its own x, which is now the world's y; its middle stays.
  e.change({.index = 0, .scale = gart::vec3d(1.5, 0.5, 0.5)});
  ball = e.scene.parts()[0];
  CHECK(ball.place.y == doctest::Approx(1));
  CHECK(ball.high.y == doctest::Approx(2.5));
  CHECK(ball.high.x == doctest::Approx(-9.5));
  CHECK(ball.scale == gart::vec3d(1.5, 0.5, 0.5));
  for (int k = 1; k <= 8; ++k)
    e.change(
        {.index = 1, .rotation = {{std::cos(0.3 * k), std::sin(0.3 * k), 0.1, 0}}, .scale = gart::vec3d(1 + 0.1 * k)});
  e.change({.index = 1, .place = vec3(1, 2, 3), .rotation = {{1, 0, 0, 0}}, .scale = gart::vec3d(-1, 1, 1)});
  CHECK(e.scene.parts()[1].place.y == doctest::Approx(2));
  e.change({.index = 1, .material = "mirror", .scale = gart::vec3d(2)});
  CHECK(e.scene.parts()[1].high.z == doctest::Approx(5));
}

TEST_CASE("a mesh is added, and a damaged one changes nothing") {
  edited e;
  fs::path const tri = e.in.write("up.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  e.scene.add(tri, "tri.obj");
  auto const parts = e.scene.parts();
  REQUIRE(parts.size() == 5);
  CHECK(parts[2].name == "tri");
  CHECK(parts[2].high.y == 1);
  CHECK(json::parse(e.scene.text())["meshes"][2]["file"] == "tri.obj");
  CHECK_THROWS_AS(e.scene.add(e.in.write("bad.obj", "v 0 0\nf 1 2 3\n"), "bad.obj"), gart::io_error);
  CHECK(e.scene.parts().size() == 5);
  e.scene.change({.index = 2, .place = vec3(0.0f)});
}

TEST_CASE("a mesh is a scene, with or without a model") {
  folder const in;
  fs::path const file = in.write("tri.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  gart::edited_scene scene(file, gart::read_scene(file), gart::vec3d(0.0), in.path / "run" / "model.ply", vec3(0.0f),
                           1);
  REQUIRE(scene.parts().size() == 1);
  json const text = json::parse(scene.text());
  CHECK(text["models"] == json::array({json{{"file", "run/model.ply"}}}));
  CHECK(text["meshes"] == json::array({json{{"file", "tri.obj"}}}));
  scene.change({.index = 0, .place = vec3(3, 0, 0), .material = "mirror"});
  CHECK(scene.scene().materials[scene.scene().meshes[0].triangle_material[0]].kind ==
        gart::light::material_kind::mirror);
}

TEST_CASE("control changes parts, and views at rest begin anew") {
  gart::view_server_options const options;
  gart::view_scene scene;
  scene.traced = true;
  scene.parts.resize(2);
  gart::view::clients all(scene, options);
  int const controls = all.add(true), looks = all.add(false);
  auto const last_text = [&](int id) {
    std::string text, last;
    while (all.take_text(id, text)) last = text;
    return last;
  };
  json const hello = json::parse(last_text(looks));
  CHECK(hello["scene"].size() == 2);
  CHECK(hello["modes"].dump() == R"(["colour","depth","normal","alpha"])");
  all.receive(looks, R"({"type":"part","index":0,"place":[1,2,3]})", 0);
  CHECK(last_text(looks).find("refused") != std::string::npos);
  CHECK_FALSE(all.next_edit());
  all.receive(controls, R"({"type":"part","index":2,"place":[1,2,3]})", 0);
  CHECK(last_text(controls).find("no such part") != std::string::npos);
  all.receive(controls, gart_test::view_text(gart_test::camera_at({0, 0, 0}), false), 0);
  auto const first = all.next_job(1, 0);
  REQUIRE(first);
  all.finish_frame(*first, {1}, 0, true);
  std::vector<gart::u8> bytes;
  REQUIRE(all.take_frame(controls, bytes, 1));
  auto const second = all.next_job(1, 0);
  REQUIRE(second);
  CHECK((second->more && second->still));
  for (int i = 0; i < 5; ++i)
    all.receive(controls, R"({"type":"part","index":1,"place":[)" + std::to_string(i) + ",0,0]}", 0);
  all.receive(controls, R"({"type":"part","index":1,"material":"mirror"})", 0);
  all.receive(controls, R"({"type":"part","index":1,"rotation":[0,2,0,0],"scale":[1,2,-3],"about":[7,8,9]})", 0);
  CHECK_FALSE(all.next_job(1, 0));  // the change comes first
  auto const edit = all.next_edit();
  REQUIRE(edit);
  CHECK(edit->index == 1);
  CHECK(edit->place->x == 4);
  CHECK(*edit->material == "mirror");
  CHECK(*edit->rotation == std::array{0.0, 2.0, 0.0, 0.0});
  CHECK(*edit->scale == gart::vec3d(1, 2, -3));
  CHECK(*edit->about == vec3(7, 8, 9));
  CHECK_FALSE(all.next_edit());
  all.set_parts(scene.parts, "{}");
  CHECK(last_text(looks).find(R"("type":"scene")") != std::string::npos);
  CHECK_FALSE(all.waited_for(*second));
  auto const anew = all.next_job(1, 0);
  REQUIRE(anew);
  CHECK_FALSE(anew->more);
  for (char const* wrong : {R"("place":[1,2])", R"("material":"wood")", R"("color":[-1,0,0])", R"("size":1)",
                            R"("rotation":[0,0,0,0])", R"("rotation":[1,0,0])", R"("scale":[1,0,1])", R"("about":1)"})
    CHECK_FALSE(all.receive(controls, std::string(R"({"type":"part","index":1,)") + wrong + "}", 0).reason.empty());
}

TEST_CASE("samples of one view end before another's begin") {
  gart::view_server_options const options;
  gart::view::clients all(gart::view_scene{}, options);
  int const a = all.add(false), b = all.add(false);
  std::vector<gart::u8> bytes;
  auto const turn = [&](bool unfinished) {
    auto const job = all.next_job(1, 0);
    REQUIRE(job);
    all.finish_frame(*job, {1}, 0, unfinished);
    CHECK(all.take_frame(job->client, bytes, 1));
    return *job;
  };
  for (int id : {a, b}) all.receive(id, gart_test::view_text(gart_test::camera_at({0, 0, 0}), false), 0);
  CHECK_FALSE(turn(true).more);
  int const second = turn(true).client;
  for (int i = 0; i < 3; ++i) {
    auto const job = turn(i < 2);
    CHECK(job.client == second);
    CHECK(job.more);
  }
  CHECK(turn(false).client == a + b - second);
  CHECK_FALSE(all.next_job(1, 0));
}
