// The capture of gart synth: it loads as the Blender dataset it claims to be, is the same for any number of threads,
// has pictures with something in them, and points that lie on the scene's surfaces.
#include <doctest/doctest.h>

#include <gart/camera/models.hpp>
#include <gart/core/error.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/file.hpp>
#include <gart/io/scene_file.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <string>

#include "support/policies.hpp"
#include "synth/synth_capture.hpp"
#include "synth/synth_random.hpp"
#include "synth/synth_trace.hpp"

#include <unistd.h>

namespace {

namespace fs = std::filesystem;
using namespace gart_cli;

struct scratch_folder {
  fs::path path = fs::temp_directory_path() / ("gart_synth_test_" + std::to_string(getpid()));
  scratch_folder() { fs::remove_all(path); }
  ~scratch_folder() { fs::remove_all(path); }
};

bool has_embree() {
  try {
    synth_renderer const probe(make_synth_scene(1), 1);
    return true;
  } catch (gart::unsupported const& missing) {
    CHECK(std::string(missing.what()).find("libembree-dev") != std::string::npos);
    MESSAGE("skipped: " << std::string(missing.what()));
    return false;
  }
}

synth_options small(fs::path const& out) {
  synth_options options;
  options.out = out, options.train = 5, options.test = 2, options.size = 24, options.samples = 4, options.points = 200;
  return options;
}

double distance_to_triangle(gart::vec3d p, gart::vec3d a, gart::vec3d b, gart::vec3d c) {
  auto const to_segment = [](gart::vec3d q, gart::vec3d s, gart::vec3d e) {
    gart::vec3d const d = e - s;
    double const length2 = glm::dot(d, d);
    return glm::length(q - s - d * (length2 > 0 ? std::clamp(glm::dot(q - s, d) / length2, 0.0, 1.0) : 0.0));
  };
  double nearest = std::min({to_segment(p, a, b), to_segment(p, b, c), to_segment(p, c, a)});
  gart::vec3d n = glm::cross(b - a, c - a);
  double const area = glm::length(n);
  if (area < 1e-14) return nearest;
  n /= area;
  gart::vec3d const foot = p - n * glm::dot(p - a, n);
  bool const inside = glm::dot(glm::cross(b - a, foot - a), n) >= 0 && glm::dot(glm::cross(c - b, foot - b), n) >= 0 &&
                      glm::dot(glm::cross(a - c, foot - c), n) >= 0;
  return inside ? std::min(nearest, std::abs(glm::dot(p - a, n))) : nearest;
}

double distance_to_scene(synth_scene const& scene, gart::vec3d p) {
  double nearest = 1e9;
  for (synth_mesh const& mesh : scene)
    for (std::size_t t = 0; t < mesh.index.size(); t += 3) {
      gart::vec3d const a(mesh.position[mesh.index[t]]);
      if (glm::length(p - a) > 0.6) continue;  // longer than the sides of all triangles near a point, but the disc's
      nearest = std::min(nearest, distance_to_triangle(p, a, gart::vec3d(mesh.position[mesh.index[t + 1]]),
                                                       gart::vec3d(mesh.position[mesh.index[t + 2]])));
    }
  return nearest;
}

}  // namespace

TEST_CASE("the samples of a stream fill every pair's square evenly") {
  std::uint64_t const seed = gart_test::seed();
  CAPTURE(seed);
  for (std::uint64_t stream = seed; stream < seed + 20; ++stream)
    for (int pair = 0; pair < 4; ++pair) {
      // 16 samples of a (0, 2) sequence: one in each cell of every elementary grid.
      int cells[5][16] = {};
      for (std::uint32_t i = 0; i < 16; ++i) {
        sample_sequence random(stream, i);
        gart::vec2 u;
        for (int k = 0; k <= pair; ++k) u = random.next();
        for (int g = 0; g < 5; ++g) {
          int const nx = 1 << g, ny = 16 >> g;
          ++cells[g][static_cast<int>(u.x * nx) + nx * static_cast<int>(u.y * ny)];
        }
      }
      for (auto const& grid : cells)
        for (int const count : grid) REQUIRE(count == 1);
    }
}

TEST_CASE("every mesh is finite, bounded, with unit normals") {
  std::uint64_t const seed = gart_test::seed();
  CAPTURE(seed);
  for (synth_mesh const& mesh : make_synth_scene(seed)) {
    REQUIRE(mesh.normal.size() == mesh.position.size());
    REQUIRE(mesh.uv.size() == mesh.position.size());
    for (std::size_t i = 0; i < mesh.position.size(); ++i) {
      REQUIRE(glm::length(mesh.position[i]) < 1.25f);  // what the cameras' field of view holds
      REQUIRE(glm::length(mesh.normal[i]) == doctest::Approx(1).epsilon(1e-4));
      gart::vec3 const albedo = mesh.material.albedo(mesh.position[i], mesh.uv[i]);
      for (int c = 0; c < 3; ++c) REQUIRE((albedo[c] >= 0 && albedo[c] <= 1));
    }
    REQUIRE(mesh.index.size() % 3 == 0);
    for (std::uint32_t const i : mesh.index) REQUIRE(i < mesh.position.size());
  }
}

TEST_CASE("the cameras look at the origin and share no position") {
  auto cameras = synth_cameras(48, 160, false);
  for (gart::camera const& c : synth_cameras(8, 160, true)) cameras.push_back(c);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    gart::vec3 const center(cameras[i].position), forward = gart::ray_direction(cameras[i], 80, 80);
    CHECK(glm::length(glm::cross(center, forward)) < 1e-5f);
    CHECK(glm::dot(center, forward) < 0);
    CHECK(center.z > 0);
    CHECK(cameras[i].rotation[1].z < 0);  // upright: the image's down is down
    CHECK(glm::determinant(cameras[i].rotation) == doctest::Approx(1));
    for (std::size_t j = 0; j < i; ++j) CHECK(glm::length(cameras[i].position - cameras[j].position) > 0.1);
  }
}

TEST_CASE("an image depends on its seed, not on threads") {
  if (!has_embree()) return;
  gart::camera const view = synth_cameras(3, 40, false)[1];
  synth_scene const scene = make_synth_scene(7);
  auto const one = synth_renderer(scene, 1).render(view, 4, 7), three = synth_renderer(scene, 3).render(view, 4, 7);
  CHECK(one.data == three.data);
  CHECK(one.data != synth_renderer(scene, 1).render(view, 4, 8).data);
  auto const points = synth_renderer(scene, 1).points({view}, 300, 7),
             again = synth_renderer(scene, 3).points({view}, 300, 7);
  CHECK(points.position == again.position);
  CHECK(points.color == again.color);
}

TEST_CASE("many samples agree with few: no bias, little noise") {
  if (!has_embree()) return;
  gart::camera const view = synth_cameras(3, 48, false)[2];
  synth_renderer const renderer(make_synth_scene(1));
  auto const few = renderer.render(view, 16, 1), many = renderer.render(view, 256, 2);
  double squared = 0, sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < few.data.size(); ++i) {
    if (many.data[i | 3] < 255 || i % 4 == 3) continue;  // colours of an edge's pixels rest on few samples
    double const d = (few.data[i] - many.data[i]) / 255.0;
    squared += d * d, sum += d, ++count;
  }
  REQUIRE(count > 500);
  CHECK(squared / count < 4e-3);
  CHECK(std::abs(sum) / count < 5e-3);
}

TEST_CASE("depth maps are distances to the surfaces shown") {
  if (!has_embree()) return;
  scratch_folder folder;
  synth_options options = small(folder.path);
  options.depth = true;
  write_synth_capture(options);
  gart::dataset_options load;
  load.depth.load = true;
  gart::dataset const data = gart::load_dataset(folder.path, load);
  synth_scene const scene = make_synth_scene(options.seed);
  double worst = 0;
  int measured = 0, differ = 0;
  for (gart::dataset_view const& v : data.train) {
    REQUIRE(v.depth.width == 24);
    for (int y = 0; y < 24; ++y) {
      for (int x = 0; x < 24; ++x) {
        float const distance = v.depth.at(x, y, 0);
        int const alpha = v.image.at(x, y, 3);
        differ += alpha == 255 && distance == 0, differ += alpha == 0 && distance > 0;  // four samples, and the middle
        if (!(distance > 0) || (x + y) % 5 != 0) continue;
        ++measured;
        gart::vec3 const d = gart::ray_direction(v.view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        gart::vec3d const p = v.view.position + static_cast<double>(distance) * gart::vec3d(d);
        if (std::abs(p.z + 0.42) < 1e-3) continue;  // the top of the disc, as below
        worst = std::max(worst, distance_to_scene(scene, p));
      }
    }
  }
  CHECK(measured > 50);
  CHECK(differ < 5 * 24 * 24 / 50);
  CHECK(worst < 1e-4);  // a step of the maps
  CHECK(data.test[0].depth.empty());
}

TEST_CASE("a capture loads with split, alpha, cameras and points") {
  if (!has_embree()) return;
  scratch_folder folder;
  synth_options const options = small(folder.path);
  int last = 0;
  write_synth_capture(options, [&](int done, int total) {
    CHECK(done == ++last);
    CHECK(total == 7);
    CHECK_FALSE(fs::exists(folder.path / "transforms_train.json"));  // no dataset before all of it is there
  });
  gart::dataset const data = gart::load_dataset(folder.path);
  CHECK(data.format == "Blender");
  REQUIRE(data.train.size() == 5);
  REQUIRE(data.test.size() == 2);
  CHECK(data.alpha);
  REQUIRE(data.points.size() == 200);
  auto const cameras = synth_cameras(5, 24, false);
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    gart::camera const& read = data.train[i].view;
    CHECK(read.fx == doctest::Approx(cameras[i].fx));
    CHECK(glm::length(read.position - cameras[i].position) < 1e-6);
    for (int k = 0; k < 3; ++k) CHECK(glm::length(read.rotation[k] - cameras[i].rotation[k]) < 1e-5f);
    gart::image8 const& image = data.train[i].image;
    REQUIRE(image.channels == 4);
    int empty = 0, full = 0;
    for (int y = 0; y < 24; ++y)
      for (int x = 0; x < 24; ++x) empty += image.at(x, y, 3) == 0, full += image.at(x, y, 3) == 255;
    CHECK(empty > 24 * 24 / 5);
    CHECK(full > 24 * 24 / 10);
    CHECK(image.at(12, 14, 3) > 0);  // the disc, below the middle
    CHECK(image.at(0, 0, 3) == 0);
  }
  synth_scene const scene = make_synth_scene(options.seed);
  double worst = 0;
  for (std::size_t i = 0; i < data.points.size(); i += 2) {
    float const* p = &data.points.position[3 * i];
    if (std::abs(p[2] + 0.42f) < 1e-5f) continue;  // the top of the disc
    worst = std::max(worst, distance_to_scene(scene, {p[0], p[1], p[2]}));
  }
  CHECK(worst < 1e-5);

  // Its own folder may be written again, with the same bytes; another's may not.
  auto const before = gart::read_file(folder.path / "train/r_3.png");
  synth_options again = options;
  again.threads = 1;
  write_synth_capture(again);
  CHECK(gart::read_file(folder.path / "train/r_3.png") == before);
  gart::write_file(folder.path / "transforms_train.json", std::string_view("{\"frames\": []}"));
  CHECK_THROWS_AS(write_synth_capture(options), gart::io_error);
  CHECK(gart::read_file(folder.path / "train/r_3.png") == before);
}

TEST_CASE("fisheye and spherical captures name camera and ray distance") {
  if (!has_embree()) return;
  for (char const* const model : {"OPENCV_FISHEYE,angle=60,k1=0.02", "EQUIRECTANGULAR"}) {
    CAPTURE(std::string(model));
    scratch_folder const folder;
    synth_options options;
    options.out = folder.path, options.camera = model, options.depth = true;
    options.train = 2, options.test = 1, options.size = 48, options.samples = 4, options.points = 50;
    write_synth_capture(options);
    gart::dataset_options load;
    load.depth.load = true;
    gart::dataset const data = gart::load_dataset(folder.path, load);
    REQUIRE(data.train.size() == 2);
    gart::camera const& c = data.train[0].view;
    bool const sphere = c.kind == gart::camera_kind::equirectangular;
    CHECK((sphere || c.kind == gart::camera_kind::fisheye));
    CHECK(c.width == (sphere ? 96 : 48));
    if (!sphere) {
      CHECK(c.lens.k1 == 0.02f);
      // The middle of the left border lies half the angle aside.
      CHECK(gart::ray_direction(c, 0, c.cy) != gart::vec3(0.0f));
      gart::vec3 const side = gart::ray_direction(c, 0, c.cy), ahead = gart::ray_direction(c, c.cx, c.cy);
      CHECK(std::acos(glm::dot(side, ahead)) == doctest::Approx(3.14159265 / 6).epsilon(1e-4));
    }
    gart::image_float const& distance = data.train[0].depth;
    REQUIRE(distance.width == c.width);
    long seen = 0, clear = 0;
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        float const t = distance.at(x, y, 0);
        if (t == 0) continue;
        ++seen;
        gart::vec3 const at = gart::vec3(c.position) +
                              t * gart::ray_direction(c, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        CHECK(std::sqrt(glm::dot(at, at)) < 1.35f);  // what the scene lies within
        clear += data.train[0].image.at(x, y, 3) == 0;
      }
    CHECK(clear < 5);  // a thin thing that no sample met
    CHECK(seen > (sphere ? 20 : 100));
  }
  synth_options options;
  options.out = fs::temp_directory_path() / "gart_synth_none", options.camera = "FISHEYE,k9=1";
  CHECK_THROWS_AS(write_synth_capture(options), gart::invalid_argument);
  options.camera = "PINCUSHION";
  CHECK_THROWS_AS(write_synth_capture(options), gart::unsupported);
  CHECK(!fs::exists(options.out));
}

TEST_CASE("parallel and rolling captures have distances along rays") {
  if (!has_embree()) return;
  for (bool const rolls : {false, true}) {
    CAPTURE(rolls);
    scratch_folder const folder;
    synth_options options;
    options.out = folder.path, options.depth = true;
    options.camera = rolls ? "" : "ORTHOGRAPHIC,extent=2.4", options.rolling = rolls ? 5 : 0;
    options.train = 2, options.test = 1, options.size = 48, options.samples = 4, options.points = 50;
    write_synth_capture(options);
    gart::dataset_options load;
    load.depth.load = true;
    gart::dataset const data = gart::load_dataset(folder.path, load);
    REQUIRE(data.train.size() == 2);
    gart::camera const& c = data.train[0].view;
    if (rolls) {
      CHECK(c.shutter == gart::shutter_kind::top_to_bottom);
      CHECK(std::sqrt(glm::dot(c.turn, c.turn)) == doctest::Approx(5 * 3.14159265 / 180).epsilon(1e-4));
      CHECK(std::sqrt(glm::dot(c.travel, c.travel)) > 0.1f);
      CHECK(data.test[0].view.shutter == gart::shutter_kind::global);
    } else {
      CHECK(c.kind == gart::camera_kind::orthographic);
      CHECK(c.fx == doctest::Approx(20));
    }
    long seen = 0, clear = 0;
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        float const t = data.train[0].depth.at(x, y, 0);
        if (t == 0) continue;
        ++seen;
        gart::ray const r = gart::ray_through(c, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        gart::vec3 const at = gart::vec3(c.position) + r.origin + t * r.direction;
        CHECK(std::sqrt(glm::dot(at, at)) < 1.35f);  // what the scene lies within
        clear += data.train[0].image.at(x, y, 3) == 0;
      }
    CHECK(clear < 5);  // a thin thing that no sample met
    CHECK(seen > 100);
  }
  synth_options options;
  options.out = fs::temp_directory_path() / "gart_synth_none", options.camera = "ORTHOGRAPHIC";
  CHECK_THROWS_WITH_AS(write_synth_capture(options), doctest::Contains("extent=UNITS"), gart::invalid_argument);
  options.camera = "ORTHOGRAPHIC,extent=2", options.rolling = 3;
  CHECK_THROWS_WITH_AS(write_synth_capture(options), doctest::Contains("no rolling shutter"), gart::invalid_argument);
  options.camera = "", options.rolling = 91;
  CHECK_THROWS_WITH_AS(write_synth_capture(options), doctest::Contains("--rolling"), gart::invalid_argument);
  CHECK(!fs::exists(options.out));
}

TEST_CASE("an option out of range is refused before writing") {
  scratch_folder folder;
  for (auto const member : {&synth_options::train, &synth_options::test, &synth_options::size, &synth_options::samples,
                            &synth_options::points}) {
    synth_options options = small(folder.path);
    options.*member = 0;
    CHECK_THROWS_AS(write_synth_capture(options), gart::invalid_argument);
  }
  CHECK_FALSE(fs::exists(folder.path));
  if (!has_embree()) return;
  std::ofstream(folder.path) << "a file";
  CHECK_THROWS_AS(write_synth_capture(small(folder.path)), gart::io_error);
}

TEST_CASE("a mirror shows what a camera behind it would see") {
  if (!has_embree()) return;
  synth_renderer const with(make_synth_scene(3, synth_mirror::plane), 2), without(make_synth_scene(3), 2);
  double const plane = make_synth_scene(3, synth_mirror::plane).back().position[0].x;
  gart::camera front;
  front.width = front.height = 48, front.fx = front.fy = 90, front.cx = front.cy = 24;
  gart::vec3d const at(1.9, 0.3, 0.75), to(plane, 0.1, 0.1),
      ahead = glm::normalize(to - at), right = glm::normalize(glm::cross(ahead, gart::vec3d(0, 0, 1))),
      down = glm::cross(ahead, right);
  front.position = at, front.rotation = gart::mat3(gart::vec3(right), gart::vec3(down), gart::vec3(ahead));
  // Behind the mirror left is right.
  gart::camera behind = front;
  behind.position.x = 2 * plane - front.position.x;
  for (int axis = 0; axis < 3; ++axis) behind.rotation[axis].x = -front.rotation[axis].x;
  behind.rotation[0] = -behind.rotation[0];
  auto const seen = with.render(front, 32, 1), meant = without.render(behind, 32, 2);
  auto const distance = with.distances(front), covered = without.distances(front);
  double sum = 0;
  int count = 0;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 48; ++x) {
      if (distance.at(x, y, 0) == covered.at(x, y, 0) || meant.at(47 - x, y, 3) != 255) continue;
      for (int c = 0; c < 3; ++c) sum += std::abs(seen.at(x, y, c) - meant.at(47 - x, y, c)), ++count;
    }
  CHECK(count > 300);
  CHECK(sum / count < 12);  // noise, and light that the mirror itself sends on
}

TEST_CASE("a capture with a mirror says where it stands") {
  if (!has_embree()) return;
  scratch_folder const folder;
  synth_options options = small(folder.path / "mirror");
  options.mirror = synth_mirror::plane;
  write_synth_capture(options);
  gart::scene_file const file = gart::read_scene(options.out / "scene.json");
  REQUIRE(file.scene.meshes.size() == 1);
  CHECK(file.scene.meshes[0].triangles.size() == 6);
  CHECK(file.scene.materials.at(file.scene.meshes[0].triangle_material[0]).kind == gart::light::material_kind::mirror);

  options.mirror = synth_mirror::ball, options.origin = "5000,-300,20";
  write_synth_capture(options);
  gart::vec3d const origin(5000, -300, 20);
  gart::light::mesh const ball = gart::read_scene(options.out / "scene.json", origin).scene.meshes.at(0);
  synth_mesh const traced = make_synth_scene(options.seed, synth_mirror::ball).back();
  CHECK(ball.positions.size() == traced.position.size());
  for (gart::vec3 const& p : ball.positions) {
    float const nearest = glm::length(p - gart::vec3(ball_center));
    if (std::abs(nearest - ball_radius) > 1e-4f) FAIL_CHECK("a corner is off the ball by " << nearest - ball_radius);
  }
}
