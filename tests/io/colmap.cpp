#include "support.hpp"

#include <cmath>

using namespace gart_test;
using gart::u32;
using gart::u64;

namespace {

struct test_image {
  u32 id, camera;
  double q[4], t[3];
  std::string name;
};

struct test_model {
  std::string cameras, images, points;
};

test_image const images[] = {
    {7, 40, {std::sqrt(0.5), 0, std::sqrt(0.5), 0}, {1, 2, 3}, "b.jpg"},  // a quarter turn about y
    {3, 9, {2, 0, 0, 0}, {-1, 0, 4}, "sub/a.jpg"},                        // not of unit norm
};
double const opencv[] = {100, 110, 31, 33, 0.1, -0.2, 0.003, -0.004};
double const radial[] = {90, 32, 34, 0.05};

test_model binary_model() {
  test_model m;
  append(m.cameras, u64{2});
  append(m.cameras, u32{40}), append(m.cameras, 4), append(m.cameras, u64{64}), append(m.cameras, u64{66});
  for (double v : opencv) append(m.cameras, v);
  append(m.cameras, u32{9}), append(m.cameras, 2), append(m.cameras, u64{64}), append(m.cameras, u64{66});
  for (double v : radial) append(m.cameras, v);
  append(m.images, u64{2});
  for (test_image const& i : images) {
    append(m.images, i.id);
    for (double v : i.q) append(m.images, v);
    for (double v : i.t) append(m.images, v);
    append(m.images, i.camera);
    m.images += i.name + '\0';
    append(m.images, u64{i.id == 7 ? 2u : 0u});
    for (int k = 0; k < (i.id == 7 ? 2 : 0); ++k)
      append(m.images, 1.0), append(m.images, 2.0), append(m.images, u64{5});
  }
  append(m.points, u64{2});
  for (int i = 0; i < 2; ++i) {
    append(m.points, u64{100});
    for (double v : {1.5, 2.5 + i, -3.5}) append(m.points, v);
    m.points += "\x01\x02\xff";
    append(m.points, 0.5);
    append(m.points, u64{1});
    append(m.points, u32{7}), append(m.points, u32{0});
  }
  return m;
}

test_model text_model() {
  return {
      "# Camera list\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n\n"
      "40 OPENCV 64 66 100 110 31 33 0.1 -0.2 0.003 -0.004\r\n9 SIMPLE_RADIAL 64 66 90 32 34 0.05\n",
      "# Image list\n7 0.70710678118654757 0 0.70710678118654757 0 1 2 3 40 b.jpg\n1 2 5 1 2 5\n"
      "3 2 0 0 0 -1 0 4 9 sub/a.jpg\n\n",
      "# 3D point list\n100 1.5 2.5 -3.5 1 2 255 0.5 7 0\n101 1.5 3.5 -3.5 1 2 255 0.5\n"};
}

void put_model(scratch_folder const& folder, test_model const& m, std::string const& place,
               std::string const& extension) {
  folder.put(place + "cameras" + extension, m.cameras);
  folder.put(place + "images" + extension, m.images);
  folder.put(place + "points3D" + extension, m.points);
}

void put_photos(scratch_folder const& folder) {
  folder.put_image("images/b.jpg", 64, 66);
  folder.put_image("images/sub/a.jpg", 64, 66);
}

gart::dataset_options all_train() {
  gart::dataset_options options;
  options.test_every = 0;
  return options;
}

void check_model(gart::dataset const& data) {
  CHECK(data.format == "COLMAP");
  REQUIRE(data.train.size() == 2);
  gart::dataset_view const &b = data.train[0], &a = data.train[1];
  CHECK(b.name == "b");
  CHECK(a.name == "sub_a");
  gart::camera const& c = b.view;
  CHECK(c.width == 64);
  CHECK(c.height == 66);
  CHECK(c.fx == 100);
  CHECK(c.fy == 110);
  CHECK(c.cx == 31);
  CHECK(c.cy == 33);
  CHECK(c.lens.k1 == 0.1f);
  CHECK(c.lens.k2 == -0.2f);
  CHECK(c.lens.p1 == 0.003f);
  CHECK(c.lens.p2 == -0.004f);
  CHECK(a.view.fx == 90);
  CHECK(a.view.fy == 90);
  CHECK(a.view.cx == 32);
  CHECK(a.view.cy == 34);
  CHECK(a.view.lens.k1 == 0.05f);
  CHECK(a.view.lens.k2 == 0);
  // R turns z to x (world to camera), so the camera's z axis is -x in the world: R = [0 0 1; 0 1 0; -1 0 0].
  float const z[] = {c.rotation[2].x, c.rotation[2].y, c.rotation[2].z};
  CHECK(z[0] == doctest::Approx(-1));
  CHECK(std::abs(z[1]) < 1e-6f);
  CHECK(std::abs(z[2]) < 1e-6f);
  CHECK(c.rotation[0].z == doctest::Approx(1));
  // -R^T t
  CHECK(c.position.x == doctest::Approx(3));
  CHECK(c.position.y == doctest::Approx(-2));
  CHECK(c.position.z == doctest::Approx(-1));
  CHECK(a.view.position.x == doctest::Approx(1));
  CHECK(a.view.position.z == doctest::Approx(-4));
  CHECK(data.points.position == std::vector<float>{1.5f, 2.5f, -3.5f, 1.5f, 3.5f, -3.5f});
  CHECK(data.points.color == std::vector<gart::u8>{1, 2, 255, 1, 2, 255});
  // half the distance of the two centres, (3, -2, -1) and (1, 0, -4), times 1.1
  CHECK(data.extent == doctest::Approx(1.1 * 0.5 * std::sqrt(4.0 + 4.0 + 9.0)));
}

}  // namespace

TEST_CASE("COLMAP models, binary and text, in each of their places") {
  for (char const* place : {"sparse/0/", "sparse/", ""}) {
    for (bool text : {false, true}) {
      CAPTURE(place);
      CAPTURE(text);
      scratch_folder const folder;
      put_model(folder, text ? text_model() : binary_model(), place, text ? ".txt" : ".bin");
      put_photos(folder);
      check_model(gart::load_dataset(folder.path, all_train()));
      check_model(gart::load_dataset(folder.path / place / (text ? "cameras.txt" : "images.bin"), all_train()));
      if (*place) check_model(gart::load_dataset(folder.path / place, all_train()));
    }
  }
}

TEST_CASE(".bin is preferred, and a named .txt is taken") {
  scratch_folder const folder;
  put_photos(folder);
  put_model(folder, binary_model(), "sparse/0/", ".bin");
  test_model other = text_model();
  other.points = "7 1 2 3 0 0 0 0\n";
  put_model(folder, other, "sparse/0/", ".txt");
  CHECK(gart::load_dataset(folder.path, all_train()).points.size() == 2);
  CHECK(gart::load_dataset(folder.path / "sparse/0/cameras.txt", all_train()).points.size() == 1);
}

TEST_CASE("every COLMAP model is read, binary and text") {
  using kind = gart::camera_kind;
  struct model {
    int number;
    std::string name;
    std::vector<double> parameters;
    kind expected;
    float gart::distortion::*member;  // one of its lens, and its value
    float value;
  };
  using lens = gart::distortion;
  model const models[] = {
      {0, "SIMPLE_PINHOLE", {50, 31, 33}, kind::perspective, &lens::k1, 0},
      {1, "PINHOLE", {50, 51, 31, 33}, kind::perspective, &lens::k1, 0},
      {2, "SIMPLE_RADIAL", {50, 31, 33, 0.1}, kind::perspective, &lens::k1, 0.1f},
      {3, "RADIAL", {50, 31, 33, 0.1, 0.02}, kind::perspective, &lens::k2, 0.02f},
      {4, "OPENCV", {50, 51, 31, 33, 0.1, 0.02, 0.001, 0.002}, kind::perspective, &lens::p2, 0.002f},
      {5, "OPENCV_FISHEYE", {50, 51, 31, 33, 0.1, 0.02, 0.001, 0.002}, kind::fisheye, &lens::k4, 0.002f},
      {6,
       "FULL_OPENCV",
       {50, 51, 31, 33, 0.1, 0.02, 0.001, 0.002, 0.03, 0.01, 0.004, 0.005},
       kind::perspective,
       &lens::d3,
       0.005f},
      {7, "FOV", {50, 51, 31, 33, 0.9}, kind::fov, &lens::omega, 0.9f},
      {8, "SIMPLE_RADIAL_FISHEYE", {50, 31, 33, 0.1}, kind::fisheye, &lens::k1, 0.1f},
      {9, "RADIAL_FISHEYE", {50, 31, 33, 0.1, 0.02}, kind::fisheye, &lens::k2, 0.02f},
      {10,
       "THIN_PRISM_FISHEYE",
       {50, 51, 31, 33, 0.1, 0.02, 0.001, 0.002, 0.03, 0.01, 0.004, 0.005},
       kind::fisheye,
       &lens::s3,
       0.005f},
      {11,
       "RAD_TAN_THIN_PRISM_FISHEYE",
       {50, 51, 31, 33, 0.1, 0.02, 0, 0, 0, 0, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006},
       kind::fisheye624,
       &lens::p2,
       0.001f},
      {12, "SIMPLE_DIVISION", {50, 31, 33, -0.1}, kind::division, &lens::k1, -0.1f},
      {13, "DIVISION", {50, 51, 31, 33, -0.1}, kind::division, &lens::k1, -0.1f},
      {14, "SIMPLE_FISHEYE", {50, 31, 33}, kind::fisheye, &lens::k1, 0},
      {15, "FISHEYE", {50, 51, 31, 33}, kind::fisheye, &lens::k1, 0},
      {16, "EUCM", {50, 51, 31, 33, 0.6, 1.1}, kind::eucm, &lens::beta, 1.1f},
      {17, "EQUIRECTANGULAR", {64, 66}, kind::equirectangular, &lens::k1, 0},
  };
  for (model const& m : models)
    for (bool text : {false, true}) {
      CAPTURE(m.name);
      scratch_folder const folder;
      put_photos(folder);
      test_model files = text ? text_model() : binary_model();
      if (text) {
        files.cameras = "40 " + m.name + " 64 66";
        for (double v : m.parameters) files.cameras += " " + std::to_string(v);
        files.cameras += "\n9 PINHOLE 64 66 50 50 32 33\n";
      } else {
        files.cameras.clear();
        append(files.cameras, u64{2});
        append(files.cameras, u32{40}), append(files.cameras, m.number), append(files.cameras, u64{64}),
            append(files.cameras, u64{66});
        for (double v : m.parameters) append(files.cameras, v);
        append(files.cameras, u32{9}), append(files.cameras, 1), append(files.cameras, u64{64}),
            append(files.cameras, u64{66});
        for (double v : {50.0, 50.0, 32.0, 33.0}) append(files.cameras, v);
      }
      put_model(folder, files, "sparse/0/", text ? ".txt" : ".bin");
      gart::camera const c = gart::load_dataset(folder.path, all_train()).train.at(0).view;
      CHECK(c.kind == m.expected);
      CHECK(c.lens.*m.member == m.value);
      if (m.expected == kind::equirectangular) continue;
      CHECK(c.fx == 50);
      CHECK(c.fy == (m.parameters[1] == 51 ? 51 : 50));
      CHECK(c.cy == 33);
    }
}

TEST_CASE("photos of another size scale intrinsics; other shapes fail") {
  scratch_folder const folder;
  put_model(folder, binary_model(), "sparse/0/", ".bin");
  put_photos(folder);
  folder.put_image("images/b.jpg", 32, 33);
  gart::dataset data = gart::load_dataset(folder.path, all_train());
  CHECK(data.train[0].view.fx == 50);
  CHECK(data.train[0].view.cy == 16.5f);
  CHECK(data.train[0].view.lens.k1 == 0.1f);
  CHECK(data.train[1].view.fx == 90);
  CHECK(any_note(data, "1 photo differ"));
  folder.put_image("images/b.jpg", 60, 33);
  std::string const what = error_of([&] { gart::load_dataset(folder.path); });
  CHECK(holds(what, "b.jpg"));
  CHECK(holds(what, "60 x 33"));
  CHECK(holds(what, "64 x 66"));
}

TEST_CASE("a missing photo is counted, all missing are an error") {
  scratch_folder const folder;
  put_model(folder, binary_model(), "sparse/0/", ".bin");
  folder.put_image("images/b.jpg", 64, 66);
  gart::dataset const data = gart::load_dataset(folder.path, all_train());
  CHECK(data.train.size() == 1);
  CHECK(any_note(data, "1 of 2 frames skipped"));
  fs::remove(folder.path / "images/b.jpg");
  CHECK(holds(error_of([&] { gart::load_dataset(folder.path); }), "none of the 2 images"));
  CHECK(gart::load_cameras(folder.path).size() == 2);  // the files state the sizes
}

TEST_CASE("points at a camera's centre or not finite are left out") {
  scratch_folder const folder;
  put_photos(folder);
  test_model m = text_model();
  m.points += "102 3 -2 -1 0 0 0 0\n103 nan 0 0 0 0 0 0\n104 1e300 0 0 0 0 0 0\n";
  put_model(folder, m, "", ".txt");
  gart::dataset const data = gart::load_dataset(folder.path, all_train());
  CHECK(data.points.size() == 2);
  CHECK(data.points.color.size() == 6);
  CHECK(any_note(data, "1 point left out: in a camera's centre"));
  CHECK(any_note(data, "2 points of"));
}

TEST_CASE("values that no camera can have are refused") {
  scratch_folder const folder;
  put_photos(folder);
  auto const refused = [&](auto const& change) {
    test_model m = text_model();
    change(m);
    put_model(folder, m, "", ".txt");
    return error_of([&] { gart::load_dataset(folder.path); });
  };
  auto const replace = [](std::string& text, std::string const& from, std::string const& to) {
    text.replace(text.find(from), from.size(), to);
  };
  CHECK(holds(refused([&](test_model& m) { replace(m.cameras, " 100 110", " 0 110"); }), "focal length"));
  CHECK(holds(refused([&](test_model& m) { replace(m.cameras, " 100 110", " nan 110"); }), "focal length"));
  CHECK(holds(refused([&](test_model& m) { replace(m.cameras, " 64 66", " -64 66"); }), "width"));
  CHECK(holds(refused([&](test_model& m) { replace(m.cameras, " 64 66", " 0 66"); }), "out of range"));
  CHECK(holds(refused([&](test_model& m) { replace(m.cameras, "OPENCV", "PINCUSHION"); }), "PINCUSHION"));
  auto const lens = [&](std::string const& text) {
    return refused([&](test_model& m) { m.cameras = "40 " + text + "\n9 PINHOLE 64 66 50 50 32 33\n"; });
  };
  CHECK(holds(lens("FISHEYE 64 66 -50 50 32 33"), "focal length"));
  CHECK(holds(lens("FOV 64 66 50 50 32 33 0"), "omega"));
  CHECK(holds(lens("FOV 64 66 50 50 32 33"), "omega is missing"));
  CHECK(holds(lens("EUCM 64 66 50 50 32 33 0.5 -1"), "beta"));
  CHECK(holds(lens("OPENCV_FISHEYE 64 66 50 50 32 33 -100 0 0 0"), "not one to one"));
  CHECK(holds(lens("THIN_PRISM_FISHEYE 64 66 50 50 32 33 0 0 500 0 0 0 0 0"), "camera 40"));
  CHECK(holds(lens("EQUIRECTANGULAR 64 66 64 65"), "EQUIRECTANGULAR"));
  // One image of two is left out (tests/cli/cases.cpp); both are nothing to train on.
  auto const both = [&](test_model& m) {
    replace(m.images, " 1 2 3 ", " inf 2 3 "), replace(m.images, "3 2 0", "3 0 0");
  };
  CHECK(holds(refused(both), "image b.jpg, the pose is not finite"));
  CHECK(holds(refused(both), "no image is without such a fault"));
  CHECK(holds(refused([&](test_model& m) { replace(m.images, "9 sub", "8 sub"); }), "camera 8 is not in"));
  CHECK(holds(refused([&](test_model& m) { m.images = "# none\n"; }), "lists no image"));
}

TEST_CASE("damaged COLMAP files are refused without great allocations") {
  gart::dataset_options options = all_train();
  for (bool text : {false, true}) {
    scratch_folder const folder;
    put_photos(folder);
    test_model const m = text ? text_model() : binary_model();
    std::string const extension = text ? ".txt" : ".bin";
    put_model(folder, m, "", extension);
    auto const load = [&] { gart::load_dataset(folder.path, options); };
    // A text file that ends after a whole record cannot be told from a shorter one.
    maltreat(folder.path / ("points3D" + extension), m.points, !text, load);
    if (text) {
      for (auto const& [name, bytes] : {std::pair{"cameras.txt", m.cameras}, std::pair{"images.txt", m.images}}) {
        for (std::size_t cut = 0; cut < bytes.size(); ++cut) {
          folder.put(name, bytes.substr(0, cut));
          error_of(load);
        }
        folder.put(name, bytes);
      }
    } else {
      maltreat(folder.path / "cameras.bin", m.cameras, true, load);
      maltreat(folder.path / "images.bin", m.images, true, load);
      for (std::string name : {"cameras.bin", "images.bin", "points3D.bin"}) {
        std::string huge = name[0] == 'c' ? m.cameras : name[0] == 'i' ? m.images : m.points;
        huge.replace(0, 8, std::string(6, '\xff') + std::string(2, '\x7f'));
        std::string const good = text_of(folder.path / name);
        folder.put(name, huge);
        CHECK(holds(error_of(load), "bytes follow"));
        folder.put(name, good);
      }
    }
  }
}
