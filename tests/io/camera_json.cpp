#include "support.hpp"

#include <gart/io/camera_file.hpp>

#include <cmath>
#include <cstring>

using namespace gart_test;

TEST_CASE("cameras of every model survive a camera JSON") {
  scratch_folder const folder;
  std::vector<gart::named_camera> cameras;
  auto const add = [&](gart::camera_kind kind, gart::distortion const& lens) {
    gart::named_camera c;
    c.name = "view" + std::to_string(cameras.size());
    c.view.kind = kind, c.view.lens = lens;
    c.view.width = 64, c.view.height = 48;
    if (kind != gart::camera_kind::equirectangular)
      c.view.fx = 30.1f, c.view.fy = 31, c.view.cx = 32.5f, c.view.cy = 23;
    c.view.position = {1.25, 1e6 + 0.1, -3};
    c.view.rotation = gart::mat3(0, 1, 0, 0, 0, 1, 1, 0, 0);
    cameras.push_back(c);
  };
  using kind = gart::camera_kind;
  gart::distortion lens;
  add(kind::perspective, lens), add(kind::fisheye, lens), add(kind::equirectangular, lens);
  lens.k1 = 0.01f;
  add(kind::perspective, lens), add(kind::fisheye, lens), add(kind::division, lens);
  lens.k3 = 0.003f;
  add(kind::perspective, lens), add(kind::fisheye, lens);
  lens.d2 = 0.01f;
  add(kind::perspective, lens);
  lens = {};
  lens.s3 = 0.001f, lens.p1 = 0.001f;
  add(kind::fisheye, lens);
  lens.k6 = 1e-5f, lens.s4 = 1e-4f;
  add(kind::fisheye624, lens);
  lens = {};
  lens.omega = 0.9f;
  add(kind::fov, lens);
  lens = {};
  lens.alpha = 0.6f, lens.beta = 1.1f;
  add(kind::eucm, lens);
  lens = {};
  add(kind::orthographic, lens);
  std::size_t const still = cameras.size();
  using shutter = gart::shutter_kind;
  for (shutter const s :
       {shutter::top_to_bottom, shutter::left_to_right, shutter::bottom_to_top, shutter::right_to_left}) {
    add(s == shutter::top_to_bottom ? kind::equirectangular : kind::perspective, lens);
    gart::camera& view = cameras.back().view;
    view.shutter = s, view.travel = {0.1f, -0.2f, 0.3f}, view.turn = {-0.05f, 0.02f, 0.1f};
  }
  gart::write_cameras(folder.path / "cameras.json", cameras);
  auto const back = gart::load_cameras(folder.path / "cameras.json");
  REQUIRE(back.size() == cameras.size());
  for (std::size_t i = 0; i < back.size(); ++i) {
    gart::camera const &a = cameras[i].view, &b = back[i].view;
    CAPTURE(i);
    CHECK(back[i].name == cameras[i].name);
    CHECK(b.kind == a.kind);
    CHECK(std::memcmp(&a.lens, &b.lens, sizeof a.lens) == 0);
    CHECK(b.fx == a.fx);
    CHECK(b.cx == a.cx);
    CHECK(b.shutter == a.shutter);
    if (i < still) {
      CHECK(b.position == a.position);
      CHECK(b.rotation == a.rotation);
      continue;
    }
    // The file has the poses of the first and the last line.
    for (int k = 0; k < 3; ++k) {
      CHECK(std::abs(b.position[k] - a.position[k]) < 1e-8);
      CHECK(std::abs(b.travel[k] - a.travel[k]) < 1e-6);
      CHECK(std::abs(b.turn[k] - a.turn[k]) < 1e-6);
      for (int j = 0; j < 3; ++j) CHECK(std::abs(b.rotation[k][j] - a.rotation[k][j]) < 1e-6);
    }
  }
  cameras.resize(1), cameras[0].view.lens.s1 = 0.1f;
  CHECK(holds(error_of([&] { gart::write_cameras(folder.path / "cameras.json", cameras); }), "no camera model"));
}

TEST_CASE("camera JSON is in OpenCV axes") {
  scratch_folder const folder;
  std::string const text =
      "[{\"name\": \"orbit/00\", \"width\": 16, \"height\": 12, \"fx\": 20, \"fy\": 21, \"cx\": 8, \"cy\": 6, "
      "\"c2w\": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}]";
  fs::path const path = folder.put("cameras.json", text);
  auto const cameras = gart::load_cameras(path);
  REQUIRE(cameras.size() == 1);
  CHECK(cameras[0].name == "orbit_00");
  CHECK(cameras[0].view.fy == 21);
  CHECK(cameras[0].view.rotation[1].y == 1);
  CHECK(cameras[0].view.position.z == 4);
  CHECK(holds(error_of([&] { gart::load_cameras(folder.put("none.json", " []")); }), "holds no camera"));
  maltreat(path, text, true, [&] { gart::load_cameras(path); });
}

TEST_CASE("a misspelt camera_model is no pinhole, and other programs' fields are passed over") {
  scratch_folder const folder;
  auto const with = [&](std::string const& more) {
    return error_of([&] {
      gart::load_cameras(
          folder.put("cameras.json",
                     "[{\"name\": \"a\", \"width\": 16, \"height\": 12, \"fx\": 20, \"fy\": 21, \"cx\": 8, "
                     "\"cy\": 6, \"c2w\": [[1,0,0,0],[0,1,0,0],[0,0,1,4],[0,0,0,1]], " +
                         more + "}]"));
    });
  };
  CHECK(with("\"time\": 3, \"camera_id\": 4, \"camera_name\": 5").empty());
  CHECK(holds(with("\"camera_modle\": \"FISHEYE\""), "has no field 'camera_modle'; did you mean camera_model?"));
  CHECK(holds(with("\"shuttertype\": \"GLOBAL\""), "did you mean shutter_type?"));
}

TEST_CASE("another camera by text: angles it can see, focal lengths, and all that it needs") {
  gart::camera view;
  view.width = 64, view.height = 48, view.fx = view.fy = 50, view.cx = 32, view.cy = 24;
  auto const refused = [&](char const* text) { return error_of([&] { gart::seen_through(view, text); }); };
  CHECK(gart::seen_through(view, "PINHOLE,angle=90").fx == doctest::Approx(24));
  CHECK(gart::seen_through(view, "FISHEYE,angle=360").fx == doctest::Approx(24 / 3.1415927));
  CHECK(gart::seen_through(view, "SIMPLE_PINHOLE,f=30").fy == 30);
  CHECK(gart::seen_through(view, "OPENCV_FISHEYE,k1=0.02").lens.k1 == 0.02f);
  CHECK(gart::seen_through(view, "EUCM,alpha=0.6,beta=1.1").lens.alpha == 0.6f);
  CHECK(gart::seen_through(view, "EQUIRECTANGULAR").width == 96);
  for (char const* text : {"PINHOLE,angle=180", "OPENCV,angle=200", "SIMPLE_PINHOLE,angle=0", "PINHOLE,angle=-20"})
    CHECK(holds(refused(text), "is not between 0 and 180"));
  for (char const* text : {"FISHEYE,angle=361", "FISHEYE,angle=0", "FOV,omega=1,angle=-1"})
    CHECK(holds(refused(text), "is not above 0, up to 360"));
  for (char const* text : {"PINHOLE,angle=179.99999", "DIVISION,k=0.1,angle=180", "EUCM,alpha=0,beta=1"})
    CHECK_MESSAGE(holds(refused(text), "the lens does not see"), text);
  for (char const* text : {"PINHOLE,fx=0", "SIMPLE_PINHOLE,f=0", "PINHOLE,fx=30,fy=0", "ORTHOGRAPHIC,fx=0,extent=2"})
    CHECK_MESSAGE(holds(refused(text), "focal length"), text);
  CHECK(holds(refused("EUCM"), "'alpha' is missing (add alpha=NUMBER)"));
  CHECK(holds(refused("EUCM,alpha=0.6"), "'beta' is missing"));
  CHECK(holds(refused("FOV"), "'omega' is missing"));
  CHECK(holds(refused("SIMPLE_DIVISION"), "'k' is missing"));
}
