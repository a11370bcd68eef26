// Depth through the program: maps to train on, and images of more than colour.
#include "program.hpp"

#include <gart/view/image_modes.hpp>

#include <gart/camera/models.hpp>
#include <gart/io/depth_file.hpp>

#include <support/policies.hpp>

using namespace cli_test;

namespace {

std::string const fast = " --iterations 6 --max-gaussians 60 --sh-degree 0 --no-auto --quiet --backend openmp";

// Distances of the capture's ball, of radius about 0.97 at 4, where its pictures show it.
void add_maps(fs::path const& at, int views) {
  auto transforms = nlohmann::json::parse(text_of(at / "transforms_train.json"));
  transforms["depth_kind"] = "distance";
  for (int i = 0; i < views; ++i) {
    std::string const name = "train/v" + std::to_string(i);
    auto const photo = gart::read_image(at / (name + ".png"));
    gart::image_float map(photo.width, photo.height, 1);
    for (int y = 0; y < photo.height; ++y)
      for (int x = 0; x < photo.width; ++x)
        if (photo.at(x, y, 1) != 20) map.at(x, y, 0) = 3.1f;
    gart::write_npy(at / (name + ".npy"), map);
    transforms["frames"][static_cast<std::size_t>(i)]["depth_file_path"] = name + ".npy";
  }
  gart::write_file(at / "transforms_train.json", transforms.dump());
}

}  // namespace

TEST_CASE("train uses depth maps on request and says what is missing") {
  folder const here;
  write_capture(here / "capture");
  auto const without = here.gart("train capture --out none --depth-weight 1" + fast);
  CHECK(without.code == 1);
  CHECK_MESSAGE(has(without.err, "the depth map of"), without.err);
  add_maps(here / "capture", 4);
  auto const with = here.gart("train capture --out run --depth-weight 1" + fast);
  REQUIRE_MESSAGE(with.code == 0, with.err);
  REQUIRE(here.gart("train capture --out plain" + fast).code == 0);
  CHECK(text_of(here / "run/model.ply") != text_of(here / "plain/model.ply"));
  CHECK(here.json("run/config.json")["options"]["depth-weight"] == 1);
  auto const resumed = here.gart("train --resume --out run --iterations 8 --quiet");
  CHECK_MESSAGE(resumed.code == 0, resumed.err);

  auto const pixel = here.gart("train capture --out other --depth-weight 1 --backward pixel" + fast);
  CHECK(pixel.code == 1);
  CHECK_MESSAGE(has(pixel.err, "backward pixel, SH degree 0, with depth"), pixel.err);
  auto const kind = here.gart("train capture --out other --depth-weight 1 --depth-kind inverse" + fast);
  CHECK(kind.code == 2);
}

TEST_CASE("depth maps go before matched photographs, also where there are trials") {
  folder const here;
  write_capture(here / "capture", 24);
  add_maps(here / "capture", 24);
  fs::remove(here / "capture/points3d.ply");
  auto const made = here.gart(
      "train capture --out run --depth-weight 1 --points 30 --max-gaussians 30 --iterations 21000 --stop-at 1 "
      "--backend openmp --exposure off --vignetting off");
  REQUIRE_MESSAGE(made.code == 130, made.err);
  CHECK(!here.json("run/config.json")["measured"]["trials"].empty());
  CHECK(has(made.out + made.err, "of its depth maps"));
  CHECK(!has(made.out + made.err, "points matched"));
}

TEST_CASE("render writes the images it is asked for") {
  folder const here;
  gart::write_splat_ply(here / "model.ply", one_gaussian());
  gart::write_file(here / "view.json",
                   R"([{"name": "v", "width": 16, "height": 12, "fx": 20, "fy": 20, "cx": 8, "cy": 6,
                        "c2w": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -4], [0, 0, 0, 1]]}])");
  std::string const render = "render model.ply view.json --backend serial --tracer bvh --quiet --out ";
  auto const all = here.gart(render + "all --images colour,depth,normal,alpha,hits --json t.json");
  REQUIRE_MESSAGE(all.code == 0, all.err);
  for (char const* name : {"v.png", "v_depth.png", "v_depth_preview.png", "v_normal.png", "v_alpha.png", "v_hits.png",
                           "v_hits_preview.png"})
    CHECK_MESSAGE(fs::exists(here / ("all/" + std::string(name))), name);
  auto const depth = gart::read_depth(here / "all/v_depth.png"), hits = gart::read_depth(here / "all/v_hits.png", 1);
  CHECK(depth.at(8, 6, 0) == doctest::Approx(4).epsilon(0.01));
  CHECK(depth.at(0, 0, 0) == 0);
  CHECK(hits.at(8, 6, 0) == 1);
  CHECK(hits.at(0, 0, 0) == 0);
  CHECK(gart::read_image(here / "all/v_alpha.png").at(8, 6, 0) > 200);
  // Towards the camera: -z.
  auto const normal = gart::read_image(here / "all/v_normal.png");
  CHECK(normal.at(8, 6, 2) < 10);
  CHECK(here.json("t.json")["views"][0]["depth_nearest"].get<double>() > 3);

  REQUIRE(here.gart(render + "raw --images depth,hits --format npy").code == 0);
  CHECK_FALSE(fs::exists(here / "raw/v.png"));
  CHECK(gart::read_depth(here / "raw/v_depth.npy").at(8, 6, 0) == doctest::Approx(4).epsilon(0.01));

  auto const none = here.gart(render + "bad --images colour,deep");
  CHECK(none.code == 2);
  CHECK_MESSAGE(has(none.err, "--images deep"), none.err);
  auto const far = here.gart(render + "bad --images depth --depth-unit 0.00001");
  CHECK(far.code == 2);
  CHECK_MESSAGE(has(far.err, "raise --depth-unit"), far.err);
  CHECK(here.gart(render + "bad --images hits --samples 2").code == 2);
}

TEST_CASE("normals are those of the surface, up to its edges") {
  gart::camera view;
  view.width = 32, view.height = 24, view.fx = view.fy = 40, view.cx = 16, view.cy = 12;
  // Left of column 20 a wall that is tilted, right of it one far behind.
  gart::vec3 const wall = gart::vec3(0.6f, 0, -0.8f);
  gart::image_float map(view.width, view.height, 1);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      gart::vec3 const d = gart::ray_direction(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      map.at(x, y, 0) = x < 20 ? -3.0f / glm::dot(wall, d) : 30.0f / d.z;
    }
  }
  map.at(5, 5, 0) = 0;
  auto const normals = gart::normals_of(map, view);
  for (int y = 0; y < view.height; ++y) {
    for (int x = 0; x < view.width; ++x) {
      gart::vec3 const n(normals.at(x, y, 0), normals.at(x, y, 1), normals.at(x, y, 2));
      if (x == 5 && y == 5)
        CHECK(glm::dot(n, n) == 0);
      else
        CHECK(glm::dot(n, x < 20 ? wall : gart::vec3(0, 0, -1)) > 0.999f);
    }
  }
}
