// What a viewer is told of a model, what a crop box leaves, and what the modes show.
#include "cameras.hpp"

#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>
#include <gart/view/image_modes.hpp>
#include <gart/view/message.hpp>
#include <gart/view/scene.hpp>

#include <doctest/doctest.h>

#include <cmath>

namespace {

gart::gaussian_model row_of(std::size_t n) {
  gart::gaussian_model m;
  m.resize(n, 1);
  for (std::size_t i = 0; i < n; ++i) {
    m.mean[3 * i] = static_cast<float>(i), m.mean[3 * i + 1] = 2, m.mean[3 * i + 2] = -static_cast<float>(i);
    m.opacity[i] = static_cast<float>(i), m.quaternion[4 * i] = 1, m.sh[12 * i + 11] = static_cast<float>(i);
  }
  return m;
}

}  // namespace

TEST_CASE("bounds leave out a hundredth on each side, and NaN") {
  gart::gaussian_model m = row_of(1001);
  m.mean[0] = -1e9f, m.mean[3 * 1000] = 1e9f, m.mean[3 * 500] = std::nanf("");
  gart::view_scene const scene = gart::scene_of("row", m, 2);
  CHECK(scene.gaussians == 1001);
  CHECK(scene.bounds.low.x == doctest::Approx(10).epsilon(0.1));
  CHECK(scene.bounds.high.x == doctest::Approx(990).epsilon(0.01));
  CHECK(scene.bounds.low.y == 2);
  CHECK(scene.up == gart::vec3(0, -1, 0));
}

TEST_CASE("up is the cameras' own, where they have one") {
  gart::camera tilted = gart_test::camera_at({0, 0, 0});
  tilted.rotation[1] = gart::vec3(0, 0, 1), tilted.rotation[2] = gart::vec3(0, -1, 0);
  gart::camera overhead = tilted;
  overhead.rotation[1] = gart::vec3(0, 0, -1), overhead.rotation[2] = gart::vec3(0, 1, 0);
  CHECK(gart::scene_of("s", row_of(3), 2, {{"a", tilted}}).up == gart::vec3(0, 0, -1));
  CHECK(gart::scene_of("s", row_of(3), 2, {{"a", tilted}, {"b", overhead}}).up == gart::vec3(0, -1, 0));
}

TEST_CASE("a crop box leaves the Gaussians whose mean is in it, whole") {
  gart::gaussian_model const m = row_of(10);
  gart::gaussian_model const part = gart::cropped(m, {{2.5f, 0, -100}, {100, 100, -7}});
  REQUIRE(part.size() == 3);
  CHECK(part.arrays_agree());
  CHECK(part.sh_degree == 1);
  for (std::size_t i = 0; i < 3; ++i) {
    CHECK(part.mean[3 * i] == static_cast<float>(7 + i));
    CHECK(part.opacity[i] == static_cast<float>(7 + i));
    CHECK(part.sh[12 * i + 11] == static_cast<float>(7 + i));
  }
  CHECK(gart::cropped(m, {{50, 50, 50}, {51, 51, 51}}).size() == 0);
}

TEST_CASE("hello names the mode error only where there are photographs") {
  gart::view_scene scene = gart::scene_of("row", row_of(5), 2, {{"a", gart_test::camera_at({0, 0, 0}), true, false}});
  CHECK(gart::hello_text(scene, true).find("\"error\"") == std::string::npos);
  CHECK(gart::hello_text(scene, true).find(R"("right":"control")") != std::string::npos);
  scene.cameras[0].photo = true;
  CHECK(gart::hello_text(scene, false).find("\"error\"") != std::string::npos);
  CHECK(gart::hello_text(scene, false).find(R"("right":"view")") != std::string::npos);
}

TEST_CASE("hello has every digit of the origin") {
  gart::view_scene scene = gart::scene_of("row", row_of(5), 2);
  CHECK(gart::hello_text(scene, false).find(R"("origin":[0.0,0.0,0.0])") != std::string::npos);
  scene.origin = {500000.125, 4000000.0625, -100};
  CHECK(gart::hello_text(scene, false).find(R"("origin":[500000.125,4000000.0625,-100.0])") != std::string::npos);
}

TEST_CASE("each mode shows what it is of") {
  gart::camera const view = gart_test::camera_at({0, 0, 0}, 0, 4, 3);
  gart::rendered r{gart::image_float(4, 3, 3, 0.25f), gart::image_float(4, 3, 1, 0.25f),
                   gart::image_float(4, 3, 1, 1.5f), gart::basic_image<gart::u32>(4, 3, 1, 3)};
  r.transmittance.at(0, 0, 0) = 0.9f;  // sees too little for a distance
  auto const color = gart::shown(r, view, gart::view_mode::colour);
  CHECK(color.image.data == gart::to_8bit(r.color).data);
  auto const depth = gart::shown(r, view, gart::view_mode::depth);
  CHECK(depth.low == 2);
  CHECK(depth.high == 2);
  CHECK(depth.image.at(0, 0, 0) == 0);
  CHECK(depth.image.at(1, 1, 0) > 0);
  auto const alpha = gart::shown(r, view, gart::view_mode::alpha);
  CHECK(alpha.image.channels == 1);
  CHECK(alpha.image.at(2, 2, 0) == 191);
  CHECK(gart::shown(r, view, gart::view_mode::hits).high == 3);
  CHECK(gart::shown(r, view, gart::view_mode::normal).image.channels == 3);
  CHECK_THROWS_AS(gart::shown(r, view, gart::view_mode::error), gart::invalid_argument);
  gart::image8 const photo(8, 6, 3, 64), black(4, 3, 4, 0);
  auto const same = gart::shown(r, view, gart::view_mode::error, &photo);
  CHECK(same.image.at(1, 1, 0) == doctest::Approx(gart::error_colors[0][0]).epsilon(0.2));
  CHECK(gart::error_between(r.color, black, gart::vec3(1.0f)).at(1, 1, 0) == doctest::Approx(0.75));
  auto const worst = gart::shown(r, view, gart::view_mode::error, &black, gart::vec3(1.0f));
  CHECK(worst.image.at(1, 1, 0) == gart::error_colors[5][0]);
}
