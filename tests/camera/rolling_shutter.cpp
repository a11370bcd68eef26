// Lenses that move while they are exposed: held to the seam, their rays to cameras that stand still at each line's
// pose. Their boxes are held in rolling_boxes.cpp.
#include "moving_pose.hpp"
#include "seam.hpp"

namespace {

using namespace gart_test;

template <class Model>
constexpr bool is_rolling = false;
template <class Lens>
constexpr bool is_rolling<gart::rolling_shutter<Lens>> = true;

gart::camera pinhole(int side) {
  gart::camera c;
  c.width = c.height = side;
  c.fx = c.fy = 0.8f * static_cast<float>(side), c.cx = c.cy = 0.5f * static_cast<float>(side);
  return c;
}

}  // namespace

TEST_CASE_TEMPLATE("lenses with a rolling shutter are traced through the seam", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  gart::camera bent = pinhole(44);
  bent.lens = {0.08f, 0.02f, 0.005f, -0.003f};
  gart::camera const still[] = {pinhole(44), bent, lens_named("OPENCV_FISHEYE", 44), lens_named("EQUIRECTANGULAR", 30)};
  for (int k = 0; k < 4; ++k) {
    CAPTURE(k);
    moving_pose const motion(random, k % 2 ? 0.3 : 0.05, k % 2 ? 0.2 : 0.5);
    gart::camera const c = motion.rolling(still[k], shutters[k]);
    auto const model = gart_test::gaussians_around(c.position, 3, 500, random);
    gart::visit_camera(c, [&](auto const& view) {
      if constexpr (is_rolling<std::decay_t<decltype(view)>>) {
        CHECK(view.one_to_one());
        gart_test::check_hits(exec, view, model);
        gart_test::check_image(exec, view, model);
        gart_test::check_gradients(exec, view, model);
      } else {
        FAIL("another model");
      }
    });
  }
}

TEST_CASE("each line of a rolling shutter has the rays of its moment") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::vector<gart::camera> still{pinhole(40)};
  for (auto const& lens : gart_test::lenses()) still.push_back(gart_test::camera_of(lens, 40));
  for (gart::camera const& lens : still)
    for (shutter_kind const shutter : shutters) {
      moving_pose const motion(random, 0.4, 2);
      gart::camera const c = motion.rolling(lens, shutter);
      REQUIRE(gart::fault_of(c).what == nullptr);
      int const lines = columns_of(shutter) ? c.width : c.height;
      double turned = 0, moved = 0;
      for (int y = 0; y < c.height; y += 3)
        for (int x = 0; x < c.width; x += 3) {
          int const line = columns_of(shutter) ? x : y;
          double const t = static_cast<double>(from_end(shutter) ? lines - 1 - line : line) / (lines - 1);
          float const u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
          gart::ray const got = gart::ray_through(c, u, v), expected = gart::ray_through(motion.at(lens, t), u, v);
          for (int k = 0; k < 3; ++k) {
            turned = std::max(turned, std::abs(double{got.direction[k]} - expected.direction[k]));
            moved = std::max(moved, std::abs(c.position[k] + double{got.origin[k]} - motion.position(t)[k]));
          }
        }
      // The ray of a lens that stands still may be found in floats, to a few of their roundings (camera/undistort.hpp).
      bool const in_floats = lens.kind == gart::camera_kind::perspective && lens.lens.any() && !lens.lens.more();
      CHECK(turned < (in_floats ? 5e-6 : 1e-6));
      CHECK(moved < 1e-6);
      // There and back.
      gart::line_poses const back = gart::poses_of_lines(c);
      for (int k = 0; k < 3; ++k) {
        CHECK(std::abs(back.first.position[k] - motion.position(0)[k]) < 1e-6);
        CHECK(std::abs(back.last.position[k] - motion.position(1)[k]) < 1e-6);
        for (int j = 0; j < 3; ++j) {
          CHECK(std::abs(back.first.rotation[k][j] - motion.axes(0)[k][j]) < 1e-6);
          CHECK(std::abs(back.last.rotation[k][j] - motion.axes(1)[k][j]) < 1e-6);
        }
      }
    }
}

// A shutter that does not move is none: the same rays, and the boxes of the lens that stands still.
TEST_CASE("a rolling shutter without a motion is the lens itself") {
  for (char const* name : {"OPENCV_FISHEYE", "EQUIRECTANGULAR"}) {
    gart::camera c = lens_named(name, 40), rolls = c;
    rolls.shutter = shutter_kind::top_to_bottom;
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        float const u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
        gart::ray const r = gart::ray_through(rolls, u, v);
        CHECK(r.origin == gart::vec3(0.0f));
        CHECK(r.direction == gart::ray_direction(c, u, v));
      }
  }
}
