// Survey coordinates: captures held from an origin among their cameras, and models that keep it through every format.

#include <gart/io/camera_file.hpp>
#include <gart/io/exposure_file.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/placed_views.hpp>
#include <gart/io/ply.hpp>

#include "support.hpp"

#include <cstdio>
#include <random>

namespace {

using namespace gart_test;
using gart::vec3d;

vec3d const survey(5e5, 4e6, 100), zero(0.0);

std::string digits(double v) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", v);
  return text;
}

// Five cameras at (i, i / 2, -4) from a place, and two points.
void write_colmap(scratch_folder const& folder, std::string const& to, vec3d const& from) {
  folder.put(to + "/sparse/0/cameras.txt", "1 PINHOLE 24 18 20 20 12 9\n");
  std::string images;
  for (int i = 0; i < 5; ++i) {
    // A quarter turn about z: the translation is not minus the centre.
    vec3d const c = from + vec3d(i, 0.5 * i, -4);
    images += std::to_string(i + 1) + " 0.7071067811865476 0 0 0.7071067811865476 " + digits(c.y) + " " + digits(-c.x) +
              " " + digits(-c.z) + " 1 v" + std::to_string(i) + ".png\n\n";
    folder.put_image(to + "/images/v" + std::to_string(i) + ".png", 24, 18);
  }
  folder.put(to + "/sparse/0/images.txt", images);
  std::string points;
  for (int i = 0; i < 2; ++i) {
    vec3d const p = from + vec3d(0.25, i, 0.125);
    points += std::to_string(i) + " " + digits(p.x) + " " + digits(p.y) + " " + digits(p.z) + " 1 2 3 0\n";
  }
  folder.put(to + "/sparse/0/points3D.txt", points);
}

bool near(vec3d const& a, vec3d const& b, double most) { return glm::length(a - b) <= most; }

gart::gaussian_model random_model(std::size_t n) {
  std::mt19937_64 random(seed());
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(n, 1);
  for (auto* values : {&m.mean, &m.log_scale, &m.quaternion, &m.opacity, &m.sh})
    for (float& v : *values) v = normal(random);
  return m;
}

}  // namespace

TEST_CASE("an origin is taken where floats lose, and near no other") {
  std::vector<vec3d> places;
  for (int i = 0; i < 9; ++i) places.push_back(vec3d(i, 0.5 * i, 2));
  CHECK(gart::origin_for(places) == zero);
  CHECK(gart::origin_for({}) == zero);
  auto const moved = [&](vec3d const& by) {
    auto all = places;
    for (vec3d& p : all) p += by;
    return gart::origin_for(all);
  };
  CHECK(moved({100, -100, 50}) == zero);  // within 64 spreads
  CHECK(moved(survey) == survey + vec3d(4, 2, 2));
  CHECK(moved({-5e5, 4e6, 0}) == vec3d(-5e5 + 4, 4e6 + 2, 2));
  // A stray is no reason for one, and does not move it.
  places.push_back({1e9, 0, 0});
  places.resize(400, vec3d(4, 2, 2));
  CHECK(gart::origin_for(places) == zero);
  CHECK(near(moved(survey), survey, 10));
  // All in one place: by what else there is.
  std::vector<vec3d> const one(3, vec3d(70, 0, 0));
  CHECK(gart::origin_for(one) == vec3d(70, 0, 0));
  CHECK(gart::origin_for(one, {60, 0, 0, 80, 0, 0, 75, 0, 0}) == zero);
  // In words and back, to the last digit.
  vec3d const odd(1.0 / 3, -4e6 - 1.0 / 7, 1e-9);
  CHECK(gart::origin_of(gart::with_origin({}, odd), "") == odd);
  CHECK(gart::to_text(survey) == "500000,4000000,100");
  CHECK(gart::with_origin({{"origin", "1,2,3"}}, zero).empty());
  for (char const* wrong : {"", "1,2", "1,2,3,4", "1,2,x", "1,2,1e300", "1;2;3", "nan,0,0"}) {
    CAPTURE(wrong);
    CHECK(holds(error_of([&] { gart::origin_of({{"origin", wrong}}, "a.ply"); }), "a.ply: the trait origin is"));
  }
}

TEST_CASE("a capture in survey coordinates is held as the one at zero") {
  scratch_folder const folder;
  write_colmap(folder, "here", zero), write_colmap(folder, "far", survey);
  gart::dataset_options options;
  options.test_every = 0;
  auto const here = gart::load_dataset(folder.path / "here", options),
             far = gart::load_dataset(folder.path / "far", options);
  CHECK(here.origin == zero);
  CHECK_FALSE(any_note(here, "origin"));
  CHECK(any_note(far, "coordinates are held from the origin " + gart::to_text(far.origin)));
  REQUIRE(near(far.origin, survey, 10));
  vec3d const by = survey - far.origin;
  for (std::size_t i = 0; i < 5; ++i) CHECK(near(far.train[i].view.position, here.train[i].view.position + by, 1e-8));
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(far.points.position[i] == doctest::Approx(here.points.position[i] + by[static_cast<int>(i % 3)]));
  CHECK(far.extent == doctest::Approx(here.extent));
  // From a given one, as a model's.
  options.origin = survey;
  auto const given = gart::load_dataset(folder.path / "far", options);
  CHECK(given.origin == survey);
  for (std::size_t i = 0; i < 5; ++i) CHECK(near(given.train[i].view.position, here.train[i].view.position, 1e-8));
  CHECK(given.points.position == here.points.position);
  options.origin = zero;
  CHECK(gart::load_dataset(folder.path / "far", options).origin == zero);

  // Cameras in files are from zero: there and back they stand where they stood.
  auto const cameras = gart::load_cameras(folder.path / "far");
  gart::write_cameras(folder.path / "cameras.json", cameras);
  auto const back = gart::load_cameras(folder.path / "cameras.json");
  for (std::size_t i = 0; i < 5; ++i) CHECK(near(back[i].view.position, far.train[i].view.position + far.origin, 1e-8));
  auto placed = far;
  for (auto& v : placed.train) v.view.position = zero;
  gart::place_training_views(placed, folder.path / "cameras.json");
  for (std::size_t i = 0; i < 5; ++i) CHECK(near(placed.train[i].view.position, far.train[i].view.position, 1e-8));
  // One that says what its poses are from.
  folder.put("from.json", R"([{"name": "a", "width": 8, "height": 8, "fx": 8, "fy": 8, "cx": 4, "cy": 4,)"
                          R"( "origin": [500000, 4000000, 100], "c2w": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}])");
  CHECK(gart::load_cameras(folder.path / "from.json")[0].view.position == survey + vec3d(1, 2, 3));
  folder.put("wrong.json", R"([{"name": "a", "width": 8, "height": 8, "fx": 8, "fy": 8, "cx": 4, "cy": 4,)"
                           R"( "origin": [1, 2], "c2w": [[1,0,0,1],[0,1,0,2],[0,0,1,3],[0,0,0,1]]}])");
  CHECK(
      holds(error_of([&] { gart::load_cameras(folder.path / "wrong.json"); }), "'origin' is not a list of 3 numbers"));

  // Points in a PLY of doubles, and exposures.
  gart::write_point_ply(folder.path / "points.ply", here.points, survey);
  auto const points = gart::read_point_ply(folder.path / "points.ply");
  CHECK(points.position[1] == static_cast<float>(4e6));
  gart::exposure_field const field({{"a", {1, 2, 3}, {0, 0, 1}, {}}, {"b", {4, 5, 6}, {0, 0, 1}, {}}});
  gart::write_exposures(folder.path / "exposures.json", field, survey);
  CHECK(holds(text_of(folder.path / "exposures.json"), "4000002"));
  CHECK(gart::read_exposures(folder.path / "exposures.json", survey).views()[1].position == vec3d(4, 5, 6));
}

TEST_CASE("models keep their origin through every format") {
  CAPTURE(seed());
  scratch_folder const folder;
  auto const model = random_model(300);
  auto const traits = gart::with_origin({}, survey);
  for (gart::splat_format const* format : gart::splat_formats()) {
    CAPTURE(format->name);
    auto const path = folder.path / (std::string("model") + format->extension);
    try {
      gart::write_splats(path, model, traits);
    } catch (gart::io_error const& e) {
      MESSAGE(std::string(e.what()));  // built without its library
      continue;
    }
    gart::splat_traits back;
    auto const read = gart::read_splats(path, &back);
    auto const lost = gart::left_out(path, model, traits);
    if (std::string(format->name) == "splat") {
      CHECK(back.empty());
      CHECK(std::find(lost.begin(), lost.end(), "origin 500000,4000000,100") != lost.end());
    } else {
      CHECK(gart::origin_of(back, "") == survey);
      CHECK(std::none_of(lost.begin(), lost.end(), [](auto const& line) { return holds(line, "origin"); }));
    }
    // What is near zero is as it was.
    gart::splat_traits none;
    gart::write_splats(path, model);
    CHECK(gart::read_splats(path, &none).mean == read.mean);
    CHECK(none.empty());
  }
}

TEST_CASE("a model in the capture's own coordinates, there and back") {
  scratch_folder const folder;
  auto const model = random_model(300);
  gart::splat_packing packing;
  packing.world = true;
  for (char const* name : {"world.ply", "world.glb"}) {
    CAPTURE(name);
    gart::write_splats(folder.path / name, model, gart::with_origin({{"alpha_min", "0.01"}}, survey), packing);
    gart::splat_traits back;
    auto read = gart::read_splats(folder.path / name, &back);
    CHECK(back["alpha_min"] == "0.01");
    vec3d const origin = gart::origin_of(back, "");
    CHECK(near(origin, survey, 10));
    gart::move_origin(read, origin, survey);
    for (std::size_t i = 0; i < model.mean.size(); ++i)
      CHECK(read.mean[i] == doctest::Approx(model.mean[i]).epsilon(1e-6));
    CHECK(read.sh == model.sh);
    // Ranks find the same origin.
    if (std::string(name) == "world.glb") continue;
    gart::u64 total = 0;
    gart::splat_traits of_rank;
    auto const mine = gart::read_splat_rows(folder.path / name, {2, 1, 16}, total, &of_rank);
    CHECK(total == 300);
    CHECK(gart::origin_of(of_rank, "") == origin);
    CHECK(mine.size() < 300);
  }
  for (char const* name : {"world.spz", "world.sog", "world.splat", "world.compressed.ply"})
    CHECK(holds(error_of([&] { gart::write_splats(folder.path / name, model, {}, packing); }),
                "no room for coordinates in double"));
}
