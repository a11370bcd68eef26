#include "support.hpp"

#include <gart/io/camera_file.hpp>
#include <gart/io/ply.hpp>

#include <chrono>
#include <cmath>
#include <set>

using namespace gart_test;

namespace {

// Camera to world in OpenGL axes: the camera stands at (0, 0, d) and looks along -z.
std::string pose(double d) { return "[[1,0,0,0],[0,1,0,0],[0,0,1," + std::to_string(d) + "],[0,0,0,1]]"; }

std::string frame(std::string const& path, double d, std::string const& more = "") {
  return "{\"file_path\": \"" + path + "\", \"transform_matrix\": " + pose(d) + more + "}";
}

std::string scene(std::string const& keys, std::string const& frames) {
  return "{" + keys + ", \"frames\": [" + frames + "]}";
}

gart::dataset_options all_train() {
  gart::dataset_options options;
  options.test_every = 0;
  return options;
}

std::string const lens =
    "\"fl_x\": 20, \"fl_y\": 21, \"cx\": 8, \"cy\": 7, \"w\": 16.0, \"h\": 12, \"k1\": 0.1, \"p2\": -0.01";

}  // namespace

TEST_CASE("Blender: field of view, axes, alpha, the files' own split") {
  scratch_folder const folder;
  double const angle = 0.7;
  std::string const keys = "\"camera_angle_x\": 0.7";
  folder.put("transforms_train.json", scene(keys, frame("./train/r_0", 4) + "," + frame("./train/r_1", 5)));
  folder.put("transforms_test.json", scene(keys, frame("./test/r_0", 6)));
  for (char const* name : {"train/r_0.png", "train/r_1.png", "test/r_0.png"}) folder.put_image(name, 16, 12, 4);
  for (fs::path const& path : {folder.path, folder.path / "transforms_train.json"}) {
    gart::dataset const data = gart::load_dataset(path);
    CHECK(data.format == "Blender");
    CHECK(holds(data.split, "own"));
    CHECK(data.alpha);
    REQUIRE(data.train.size() == 2);
    REQUIRE(data.test.size() == 1);
    CHECK(data.train[1].name == "train_r_1");
    CHECK(data.test[0].name == "test_r_0");
    gart::camera const& c = data.train[1].view;
    CHECK(c.fx == doctest::Approx(8 / std::tan(angle / 2)));
    CHECK(c.fy == c.fx);
    CHECK(c.cx == 8);
    CHECK(c.cy == 6);
    CHECK(c.position.z == 5);
    CHECK(c.rotation[0].x == 1);
    CHECK(c.rotation[1].y == -1);  // down
    CHECK(c.rotation[2].z == -1);  // forward
    CHECK(data.train[1].image.channels == 4);
    CHECK(data.bounds_max.x == 1.3);
    CHECK(data.points.size() == 0);
    CHECK(data.extent == doctest::Approx(0.55));
  }
  auto const cameras = gart::load_cameras(folder.path);
  REQUIRE(cameras.size() == 3);
  CHECK(cameras[0].name == "test_r_0");
  gart::write_point_ply(folder.path / "points3d.ply", {{1, 2, 3}, {4, 5, 6}});
  CHECK(gart::load_dataset(folder.path).points.size() == 1);
}

TEST_CASE("views of which masks leave nothing are left out, and named") {
  scratch_folder const folder;
  std::string frames;
  for (int i = 0; i < 4; ++i) {
    std::string const number = std::to_string(i);
    frames += (i ? "," : "") + frame("images/" + number + ".png", i, ", \"mask_path\": \"masks/" + number + ".png\"");
    folder.put_image("images/" + number + ".png", 16, 12);
  }
  fs::path const path = folder.put("transforms.json", scene(lens, frames));
  fs::create_directories(folder.path / "masks");
  auto const put_masks = [&](int sound) {
    for (int i = 0; i < 4; ++i) {
      gart::image8 mask(16, 12, 1);
      if (i < sound) mask.at(3, 5, 0) = 255;
      gart::write_png(folder.path / "masks" / (std::to_string(i) + ".png"), mask);
    }
  };
  put_masks(3);
  gart::dataset const data = gart::load_dataset(folder.path, {.test_every = 2});
  CHECK(data.test.size() == 2);
  CHECK(data.train.size() == 1);
  CHECK(any_note(data, "1 view left out: the mask excludes every pixel, such as "));
  put_masks(0);
  CHECK_THROWS_WITH_AS(gart::load_dataset(folder.path), doctest::Contains("invert the masks"), gart::io_error);
  gart::dataset_options unmasked;
  unmasked.masks = false;
  CHECK(gart::load_dataset(folder.path, unmasked).train.size() +
            gart::load_dataset(folder.path, unmasked).test.size() ==
        4);
}

TEST_CASE("nerfstudio: intrinsics, masks, points, lost photos, split") {
  scratch_folder const folder;
  std::string frames;
  for (int i = 0; i < 18; ++i) {
    std::string const name = "images/" + std::to_string(100 + 17 - i) + (i == 3 ? ".png" : "");
    std::string const more = i == 3 ? ", \"fl_x\": 30, \"k1\": 0, \"mask_path\": \"masks/m.png\"" : "";
    if (i) frames += ',';
    frames += frame(name, i, more);
    if (i == 5) continue;
    folder.put_image("images/" + std::to_string(100 + 17 - i) + (i % 2 ? ".png" : ".jpg"), 16, 12);
  }
  gart::image8 mask(16, 12, 3, 255);
  for (int c = 0; c < 3; ++c) mask.at(4, 3, c) = 0;
  fs::create_directories(folder.path / "masks");
  gart::write_png(folder.path / "masks/m.png", mask);
  gart::write_point_ply(folder.path / "cloud.ply", {{1, 2, 3}, {4, 5, 6}});
  fs::path const path = folder.put(
      "transforms.json", scene(lens + ", \"camera_model\": \"OPENCV\", \"ply_file_path\": \"cloud.ply\"", frames));
  gart::dataset const data = gart::load_dataset(folder.path);
  CHECK(data.format == "nerfstudio");
  CHECK(any_note(data, "1 of 18 frames skipped"));
  CHECK(holds(data.split, "index % 8 == 0"));
  CHECK(holds(data.split, "no split"));
  REQUIRE(data.train.size() == 14);
  REQUIRE(data.test.size() == 3);
  CHECK(data.test[0].name == "100");
  CHECK(data.test[1].name == "108");
  CHECK(data.test[2].name == "117");  // 112 is the one without a photo
  CHECK(data.points.position == std::vector<float>{1, 2, 3});
  CHECK_FALSE(data.alpha);
  int masks = 0;
  for (gart::dataset_view const& v : data.train) {
    bool const odd = v.name == "114";
    masks += !v.mask.empty();
    CHECK(v.view.fx == (odd ? 30 : 20));
    CHECK(v.view.fy == 21);
    CHECK(v.view.cy == 7);
    CHECK(v.view.lens.k1 == (odd ? 0.0f : 0.1f));
    CHECK(v.view.lens.p2 == -0.01f);
    if (odd) {
      REQUIRE(v.mask.data.size() == 16 * 12);
      CHECK(v.mask.at(4, 3, 0) == 0);
      CHECK(v.mask.at(5, 3, 0) == 255);
    }
  }
  CHECK(masks == 1);
  gart::dataset_options half;
  half.downscale = 5;
  std::size_t calls = 0, last = 0;
  half.progress = [&](std::size_t done, std::size_t total) {
    ++calls, last = done;
    CHECK(total == 17);
  };
  gart::dataset const small = gart::load_dataset(path, half);
  CHECK(calls == 17);
  CHECK(last == 17);
  for (gart::dataset_view const& v : small.train) {
    CHECK(v.view.width == 3);  // 16 / 5, the last column of pixels dropped
    CHECK(v.view.height == 2);
    CHECK(v.image.width == 3);
    CHECK(v.view.fy == doctest::Approx(21 / 5.0));
    CHECK(v.view.cx == doctest::Approx(8 / 5.0));
    if (!v.mask.empty()) CHECK(v.mask.data == std::vector<gart::u8>{0, 255, 255, 255, 255, 255});
  }
}

TEST_CASE("transforms.json with a split of its own") {
  scratch_folder const folder;
  for (char const* name : {"a.png", "b.png", "c.png"}) folder.put_image(name, 16, 12);
  folder.put("transforms.json", scene(lens + ", \"train_filenames\": [\"a.png\"], \"test_filenames\": [\"b.png\"]",
                                      frame("a.png", 1) + "," + frame("b.png", 2) + "," + frame("c.png", 3)));
  gart::dataset const data = gart::load_dataset(folder.path);
  REQUIRE(data.train.size() == 1);
  REQUIRE(data.test.size() == 1);
  CHECK(data.train[0].name == "a");
  CHECK(data.test[0].name == "b");
  CHECK(holds(data.split, "own"));
  CHECK(any_note(data, "1 frame left out"));
  folder.put("transforms.json", scene(lens + ", \"train_filenames\": [\"x\"], \"test_filenames\": [\"y\"]",
                                      frame("a.png", 1) + "," + frame("b.png", 2)));
  CHECK(holds(error_of([&] { gart::load_cameras(folder.path); }), "hold none of its frames"));
}

TEST_CASE("without points the box lies where the cameras look") {
  scratch_folder const folder;
  std::string frames;
  for (int i = 0; i < 8; ++i) {
    double const angle = i * 0.7853981633974483, s = std::sin(angle), c = std::cos(angle);
    auto const text = [](double v) { return std::to_string(v); };
    // On a circle of radius 3 around (5, 6, 7), the camera's +z axis (its back) pointing outwards.
    if (i) frames += ',';
    frames += "{\"file_path\": \"" + std::to_string(i) + ".png\", \"transform_matrix\": [[" + text(-s) + ",0," +
              text(c) + "," + text(5 + 3 * c) + "],[" + text(c) + ",0," + text(s) + "," + text(6 + 3 * s) +
              "],[0,1,0,7],[0,0,0,1]]}";
    folder.put_image(std::to_string(i) + ".png", 16, 12);
  }
  folder.put("transforms.json", scene(lens, frames));
  gart::dataset const data = gart::load_dataset(folder.path, all_train());
  for (int k = 0; k < 3; ++k) {
    CHECK(data.bounds_min[k] == doctest::Approx(5 + k - 3).epsilon(1e-4));
    CHECK(data.bounds_max[k] == doctest::Approx(5 + k + 3).epsilon(1e-4));
  }
  CHECK(any_note(data, "look at"));
}

TEST_CASE("names are unique and fit for files") {
  scratch_folder const folder;
  std::string frames;
  char const* const paths[] = {"x/a b.png", "x_a b.png", "../up.png", "a.png", "a.jpg", "a_truth.png"};
  scratch_folder const& f = folder;
  fs::create_directories(f.path / "scene");
  for (char const* path : paths) {
    f.put_image(fs::path("scene") / path, 16, 12);
    if (!frames.empty()) frames += ',';
    frames += frame(path, 1);
  }
  f.put("scene/transforms.json", scene(lens, frames));
  std::set<std::string> names;
  gart::dataset const data = gart::load_dataset(f.path / "scene", all_train());
  for (gart::dataset_view const& v : data.train) {
    names.insert(v.name);
    CHECK(v.name.find_first_of("/ \\") == std::string::npos);
  }
  CHECK(names.size() == 6);
  CHECK(names.count("up"));
  CHECK(names.count("x_a_b"));
  CHECK(!(names.count("a") && names.count("a_truth")));
}

TEST_CASE("20,000 cameras of one name are told apart in little time") {
  scratch_folder const folder;
  std::string text = "[";
  for (int i = 0; i < 20000; ++i) {
    text += std::string(i ? "," : "") +
            R"({"name":"a","width":1,"height":1,"fx":1,"fy":1,"cx":0,"cy":0,"c2w":[[1,0,0,0],[0,1,0,0],[0,0,1,0]]})";
  }
  fs::path const path = folder.put("cameras.json", text + "]");
  auto const begin = std::chrono::steady_clock::now();
  auto const cameras = gart::load_cameras(path);
  CHECK(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() < 20);
  std::set<std::string> names;
  for (gart::named_camera const& c : cameras) names.insert(c.name);
  CHECK(names.size() == 20000);
  CHECK(names.count("a_20000"));
}

TEST_CASE("COLMAP beside transforms.json is used and said") {
  scratch_folder const folder;
  folder.put_image("images/a.png", 16, 12);
  folder.put("sparse/0/cameras.txt", "1 PINHOLE 16 12 20 20 8 6\n");
  folder.put("sparse/0/images.txt", "1 1 0 0 0 0 0 0 1 a.png\n\n");
  fs::path const json = folder.put("transforms.json", scene(lens, frame("images/a.png", 1)));
  gart::dataset const data = gart::load_dataset(folder.path, all_train());
  CHECK(data.format == "COLMAP");
  CHECK(any_note(data, json.string()));
  CHECK(gart::load_dataset(json, all_train()).format == "nerfstudio");
  gart::dataset_options one;
  CHECK(holds(error_of([&] { gart::load_dataset(folder.path, one); }), "no view is left to train on"));
}

TEST_CASE("what is missing, of a wrong type or not traced is named") {
  scratch_folder const folder;
  folder.put_image("a.png", 16, 12);
  fs::path const path = folder.path / "transforms.json";
  auto const refused = [&](std::string const& text) {
    folder.put("transforms.json", text);
    std::string const what = error_of([&] { gart::load_dataset(folder.path, all_train()); });
    CHECK(holds(what, path.string()));
    return what;
  };
  std::string const one = frame("a.png", 1), focal = "\"fl_x\": 20, \"w\": 16, \"h\": 12";
  CHECK(holds(refused("{\"fl_x\": 1}"), "'frames' is missing"));
  CHECK(holds(refused("[1]"), "not a JSON object"));
  CHECK(holds(refused("{\"frames\": 3}"), "'frames' is not a list"));
  CHECK(holds(refused(scene(lens, "")), "lists no image"));
  CHECK(holds(refused(scene(lens, "4")), "frame 0"));
  CHECK(holds(refused(scene(lens, "{\"transform_matrix\": " + pose(1) + "}")), "'file_path' is missing"));
  CHECK(holds(refused(scene(lens, "{\"file_path\": \"a.png\"}")), "'transform_matrix' is missing"));
  CHECK(holds(refused(scene(lens, "{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,0],[0,1,0],[0,0,1,0]]}")),
              "matrix"));
  CHECK(holds(
      refused(scene(lens, "{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,0],[0,\"1\",0,0],[0,0,1,0]]}")),
      "matrix"));
  CHECK(
      holds(refused(scene(lens, "{\"file_path\": \"a.png\", \"transform_matrix\": [[-1,0,0,0],[0,1,0,0],[0,0,1,0]]}")),
            "not a rotation"));
  CHECK(holds(refused(scene(lens, "{\"file_path\": \"a.png\", \"transform_matrix\": [[0,0,0,0],[0,0,0,0],[0,0,0,0]]}")),
              "not a rotation"));
  CHECK(holds(
      refused(scene(lens, "{\"file_path\": \"a.png\", \"transform_matrix\": [[1,0,0,1e300],[0,1,0,0],[0,0,1,0]]}")),
      "not finite"));
  CHECK(holds(refused(scene("\"w\": 16, \"h\": 12", one)), "'fl_x'"));
  CHECK(holds(refused(scene("\"fl_x\": \"20\"", one)), "'fl_x' is not a number"));
  CHECK(holds(refused(scene("\"fl_x\": 0, \"w\": 16, \"h\": 12", one)), "focal length"));
  CHECK(holds(refused(scene("\"fl_x\": 20, \"w\": -16, \"h\": 12", one)), "'w' is not a size"));
  CHECK(holds(refused(scene(lens,
                            "{\"file_path\": \"a.png\", \"transform_matrix\": "
                            "[[1,0,0,3e38],[0,1,0,0],[0,0,1,0]]}")),
              "farther than 1e18"));
  CHECK(holds(refused(scene("\"fl_x\": 20, \"w\": 16", one)), "'h'"));
  CHECK(holds(refused(scene("\"camera_angle_x\": 4", one)), "angle"));
  CHECK(
      holds(refused(scene(lens + ", \"camera_model\": \"OMNIDIRECTIONALSTEREO_L\"", one)), "OMNIDIRECTIONALSTEREO_L"));
  CHECK(holds(refused(scene(lens + ", \"k5\": 0.1", one)), "'k5' is not zero"));
  CHECK(holds(refused(scene(lens + ", \"camera_model\": \"FISHEYE\", \"k1\": 0.1", one)), "'k1' is not zero"));
  CHECK(holds(refused(scene(focal + ", \"camera_model\": \"FOV\"", one)), "'omega' is missing"));
  CHECK(
      holds(refused(scene(focal + ", \"camera_model\": \"FOV\", \"omega\": -1, \"w\": 16, \"h\": 12", one)), "omega"));
  CHECK(holds(refused(scene(focal + ", \"camera_model\": \"EUCM\", \"alpha\": 0.5", one)), "'beta' is missing"));
  CHECK(holds(
      refused(scene(focal + ", \"camera_model\": \"EUCM\", \"alpha\": 2, \"beta\": 1, \"w\": 16, \"h\": 12", one)),
      "alpha"));
  CHECK(holds(refused(scene(focal + ", \"camera_model\": \"DIVISION\"", one)), "'k' is missing"));
  CHECK(holds(refused(scene(focal + ", \"camera_model\": \"OPENCV_FISHEYE\", \"k1\": -4e4, \"w\": 16, \"h\": 12", one)),
              "not one to one"));
  CHECK(holds(refused(scene("\"camera_angle_x\": 1, \"camera_model\": \"FISHEYE\"", one)), "'fl_x' is missing"));
  CHECK(
      holds(refused(scene("\"fl_x\": -3, \"camera_model\": \"FISHEYE\", \"w\": 16, \"h\": 12", one)), "focal length"));
  CHECK(holds(refused(scene(lens, frame("none.png", 1))), "none of the 1 image"));
  folder.put("transforms.json", scene(lens + ", \"ply_file_path\": \"none.ply\"", one));
  CHECK(holds(error_of([&] { gart::load_dataset(folder.path, all_train()); }), "none.ply"));
  folder.put("transforms.json", scene("\"fl_x\": 20, \"w\": 16, \"h\": 20", one));
  CHECK(holds(error_of([&] { gart::load_dataset(folder.path, all_train()); }), "a.png"));
  folder.put("transforms.json", scene("\"fl_x\": 3e38, \"w\": 4, \"h\": 3", one));
  CHECK(holds(error_of([&] { gart::load_dataset(folder.path, all_train()); }), "focal length"));
  folder.put("transforms.json", scene("\"fl_x\": 0", one));
  CHECK(holds(error_of([&] { gart::load_dataset(folder.path, all_train()); }), "focal length"));
  CHECK(holds(error_of([&] { gart::load_dataset(folder.path / "none"); }), "no such file"));
  scratch_folder const empty;
  CHECK(holds(error_of([&] { gart::load_dataset(empty.path); }), "holds no capture"));
}

TEST_CASE("where no capture is found, the error names one that lies below") {
  scratch_folder const folder;
  folder.put("photos/later/transforms.json", "{}");
  folder.put("dense/0/sparse/0/cameras.txt", "# none\n");
  folder.put("dense/0/sparse/0/images.txt", "# none\n");
  std::string const error = error_of([&] { gart::load_dataset(folder.path); });
  CHECK(holds(error, "holds no capture"));
  CHECK(holds(error, (folder.path / "dense/0").string() + " holds one"));
}

TEST_CASE("photographs without cameras are counted, and a capture one folder up is named") {
  scratch_folder const folder;
  auto const refused = [&](fs::path const& path) { return error_of([&] { gart::load_dataset(path); }); };
  folder.put("images/a.jpg", ""), folder.put("images/b.JPG", ""), folder.put("images/notes.md", "");
  for (char const* path : {"", "images", "images/"}) {
    CHECK(holds(refused(folder.path / path), "holds 2 photographs but no cameras"));
    CHECK(holds(refused(folder.path / path), "COLMAP: docs/getting_started.md"));
  }
  folder.put("transforms.json", "{}");
  for (char const* path : {"images", "images/"})
    CHECK(holds(refused(folder.path / path),
                "but no cameras (the capture is one folder up: name " + (folder.path / "").string() + ")"));
}

TEST_CASE("a model or a training in place of a capture is called that") {
  scratch_folder const folder;
  auto const refused = [&](fs::path const& path) { return error_of([&] { gart::load_dataset(path); }); };
  fs::path const model = folder.put("run/model.ply", "");
  CHECK(holds(refused(model), "is a model, where a capture is wanted (name a capture; the two may be swapped"));
  CHECK(holds(refused(folder.path / "run"), "is the folder of a training, where a capture is wanted"));
  CHECK(holds(refused(folder.path / "run"), "name " + model.string()));
}

TEST_CASE("a camera JSON in place of a capture, and one camera in place of a list, are called that") {
  scratch_folder const folder;
  auto const refused = [&](fs::path const& path) { return error_of([&] { gart::load_dataset(path); }); };
  std::string const camera =
      "{\"name\": \"a\", \"width\": 16, \"height\": 12, \"fx\": 20, \"fy\": 20, \"cx\": 8, \"cy\": 6, \"c2w\": " +
      pose(1) + "}";
  fs::path const list = folder.put("list.json", "[" + camera + "]"), one = folder.put("one.json", camera);
  CHECK(gart::load_cameras(list).size() == 1);
  CHECK(holds(refused(list), "is a camera JSON, which has no photographs"));
  CHECK(holds(error_of([&] { gart::load_cameras(one); }), "put [ ] round it"));
  CHECK(holds(refused(folder.put("numbers.json", "[1]")), "is not a JSON object"));
}

TEST_CASE("a file is called truncated only where JSON ends too early") {
  scratch_folder const folder;
  auto const refused = [&](std::string const& text) {
    return error_of([&] { gart::load_dataset(folder.put("transforms.json", text)); });
  };
  for (char const* whole : {"{\"frames\": [1,]}", "{\"frames\": }", "{} {}"}) {
    std::string const error = refused(whole);
    CHECK(holds(error, "is not valid JSON: parse error at line 1, column"));
    CHECK(holds(error, "(correct it at that place)"));
  }
  for (char const* cut : {"", "{\"frames\": [", "{\"fra"}) {
    std::string const error = refused(cut);
    CHECK_MESSAGE(holds(error, "(the file is truncated: copy or export it again)"), error);
    CHECK_FALSE(holds(error, "json.exception"));
  }
}

TEST_CASE("damaged JSON is refused and never crashes") {
  scratch_folder const folder;
  folder.put_image("a.png", 16, 12);
  std::string const text = scene(lens, frame("a.png", 1));
  maltreat(folder.put("transforms.json", text), text, true,
           [&] { gart::load_dataset(folder.path / "transforms.json", all_train()); });
}

TEST_CASE("transforms.json names its lenses") {
  scratch_folder const folder;
  folder.put_image("a.png", 16, 12);
  auto const read = [&](std::string const& more) {
    folder.put("transforms.json", scene(more + ", \"w\": 16, \"h\": 12", frame("a.png", 1)));
    return gart::load_dataset(folder.path, all_train()).train.at(0).view;
  };
  std::string const focal = "\"fl_x\": 20, \"fl_y\": 21";
  gart::camera c = read(focal + ", \"camera_model\": \"OPENCV_FISHEYE\", \"k1\": 0.01, \"k4\": 0.002");
  CHECK(c.kind == gart::camera_kind::fisheye);
  CHECK(c.lens.k4 == 0.002f);
  CHECK(c.cy == 6);
  CHECK(read(focal + ", \"is_fisheye\": true, \"k2\": 0.01").kind == gart::camera_kind::fisheye);
  c = read("\"camera_model\": \"EQUIRECTANGULAR\"");
  CHECK(c.kind == gart::camera_kind::equirectangular);
  CHECK(c.width == 16);
  gart::dataset_options smaller = all_train();
  smaller.downscale = 4;
  CHECK(gart::load_dataset(folder.path, smaller).train.at(0).view.height == 3);
  smaller.downscale = 5;  // a part of the sphere would be left out
  CHECK(holds(error_of([&] { gart::load_dataset(folder.path, smaller); }), "does not divide 16 x 12"));
  c = read(focal + ", \"camera_model\": \"FULL_OPENCV\", \"k3\": 0.01, \"k4\": 0.02, \"k6\": 0.03");
  CHECK(c.kind == gart::camera_kind::perspective);
  CHECK(c.lens.k3 == 0.01f);
  CHECK(c.lens.d1 == 0.02f);
  CHECK(c.lens.d3 == 0.03f);
  c = read(focal + ", \"camera_model\": \"OPENCV\", \"k3\": 0.01, \"k4\": 0.02");
  CHECK(c.lens.k4 == 0.02f);
  c = read(focal + ", \"camera_model\": \"EUCM\", \"alpha\": 0.6, \"beta\": 1.2");
  CHECK(c.kind == gart::camera_kind::eucm);
  CHECK(c.lens.beta == 1.2f);
  for (char const* name : {"ORTHOPHOTO", "ORTHOGRAPHIC"}) {
    c = read(focal + ", \"camera_model\": \"" + name + "\"");
    CHECK(c.kind == gart::camera_kind::orthographic);
    CHECK(c.fy == 21);
    CHECK(c.cx == 8);
  }
}

TEST_CASE("a rolling shutter is read with two poses or refused") {
  scratch_folder const folder;
  folder.put_image("a.png", 16, 12);
  fs::path const path = folder.path / "transforms.json";
  std::string const sized = "\"fl_x\": 20, \"w\": 16, \"h\": 12, \"shutter_type\": ";
  auto const moving = [](std::string const& more) {
    return "{\"file_path\": \"a.png\", \"transform_matrix\": " + pose(1) + more + "}";
  };
  std::string const end = ", \"transform_matrix_end\": " + pose(3);
  auto const read = [&](std::string const& text, gart::dataset_options const& options = all_train()) {
    folder.put("transforms.json", text);
    return gart::load_dataset(folder.path, options).train.at(0).view;
  };
  gart::camera const c = read(scene(sized + "\"ROLLING_BOTTOM_TO_TOP\"", moving(end)));
  CHECK(c.shutter == gart::shutter_kind::bottom_to_top);
  CHECK(c.position.z == 2);
  // From the first line's pose to the last's are 11 of 12 lines.
  CHECK(c.travel.x * c.rotation[0].z + c.travel.y * c.rotation[1].z + c.travel.z * c.rotation[2].z ==
        doctest::Approx(2 * 12 / 11.0));
  CHECK(c.turn == gart::vec3(0.0f));
  CHECK(read(scene(sized + "\"GLOBAL\"", moving(end))).shutter == gart::shutter_kind::global);
  // Of five rows out of twelve two whole ones are left, of ten: the motion is theirs.
  gart::dataset_options fifth = all_train();
  fifth.downscale = 5;
  gart::camera const small = read(scene(sized + "\"ROLLING_TOP_TO_BOTTOM\"", moving(end)), fifth);
  CHECK(small.height == 2);
  CHECK(std::sqrt(glm::dot(small.travel, small.travel)) == doctest::Approx(2 * 12 / 11.0 * 10 / 12));
  CHECK(small.position.z == doctest::Approx(2 - 2 * 12 / 11.0 / 12));
  auto const refused = [&](std::string const& text) {
    std::string const what = error_of([&] { read(text); });
    CHECK(holds(what, path.string()));
    CHECK(holds(what, "frame 0"));
    return what;
  };
  CHECK(holds(refused(scene(sized + "\"ROLLING_TOP_TO_BOTTOM\"", moving(""))), "'transform_matrix_end' is missing"));
  CHECK(holds(refused(scene(sized + "\"TOP\"", moving(end))), "write one of GLOBAL, ROLLING_TOP_TO_BOTTOM"));
  CHECK(holds(refused(scene(sized + "3", moving(end))), "'shutter_type' is not a text"));
  CHECK(holds(refused(scene(lens, moving(end))), "'shutter_type' is missing"));
  CHECK(holds(refused(scene(sized + "\"ROLLING_TOP_TO_BOTTOM\"", moving(", \"transform_matrix_end\": " + pose(1)))),
              "nothing moves"));
  CHECK(holds(refused(scene(sized + "\"ROLLING_TOP_TO_BOTTOM\"", moving(", \"transform_matrix_end\": [[1]]"))),
              "'transform_matrix_end' is not a matrix"));
  CHECK(holds(refused(scene("\"fl_x\": 20, \"shutter_type\": \"ROLLING_TOP_TO_BOTTOM\"", moving(end))),
              "'w' and 'h' are missing"));
  CHECK(holds(
      refused(scene("\"fl_x\": 20, \"w\": 16, \"h\": 1, \"shutter_type\": \"ROLLING_TOP_TO_BOTTOM\"", moving(end))),
      "one line"));
  CHECK(holds(refused(scene(sized + "\"ROLLING_TOP_TO_BOTTOM\", \"camera_model\": \"ORTHOPHOTO\"", moving(end))),
              "no rolling shutter"));
  CHECK(holds(refused(scene(sized + "\"ROLLING_TOP_TO_BOTTOM\"",
                            moving(", \"transform_matrix_end\": [[-1,0,0,0],[0,1,0,0],[0,0,-1,0]]"))),
              "half a turn"));
}

TEST_CASE("a sector tests cameras that stand beside each other") {
  scratch_folder const folder;
  constexpr int cameras = 24;
  std::string frames;
  for (int i = 0; i < cameras; ++i) {
    // All the way round the y axis, in steps of 7 of 24 by name.
    double const angle = 6.283185307179586 * (7 * i % cameras) / cameras, c = std::cos(angle), s = std::sin(angle);
    std::string const n = (i < 10 ? "0" : "") + std::to_string(i);
    folder.put_image("images/" + n + ".png", 16, 12, 3);
    frames += std::string(i ? "," : "") + "{\"file_path\": \"images/" + n + ".png\", \"transform_matrix\": [[" +
              std::to_string(c) + ",0," + std::to_string(s) + "," + std::to_string(4 * s) + "],[0,1,0,0.3],[" +
              std::to_string(-s) + ",0," + std::to_string(c) + "," + std::to_string(4 * c) + "],[0,0,0,1]]}";
  }
  folder.put("transforms.json", scene(lens, frames));
  gart::dataset_options options;
  options.test_split = gart::split_kind::sector;
  for (int const every : {8, 4}) {
    options.test_every = every;
    auto const data = gart::load_dataset(folder.path, options);
    CHECK(holds(data.split, "sector"));
    REQUIRE(data.test.size() == static_cast<std::size_t>(cameras / every));
    CHECK(data.train.size() == static_cast<std::size_t>(cameras - cameras / every));
    double widest = 0, nearest = 7;
    auto const from_first = [](gart::camera const& v) { return std::abs(std::atan2(v.position.x, v.position.z)); };
    for (auto const& v : data.test) widest = std::max(widest, from_first(v.view));
    for (auto const& v : data.train) nearest = std::min(nearest, from_first(v.view));
    CHECK(widest <= nearest + 1e-6);
  }
  options.test_every = 0;
  CHECK(gart::load_dataset(folder.path, options).test.empty());
}
