// What people bring: captures and models as other programs, systems and hands leave them. Each is read as what it
// means, or refused by a message that says what to do, and what is left out of it is counted and said.

#include "program.hpp"

#include <gart/io/dataset.hpp>
#include <gart/io/splat_file.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <random>

using namespace cli_test;

namespace {

constexpr int views = 6, width = 24, height = 18;
constexpr float nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();

std::string name_of(int i) { return "view_0" + std::to_string(i) + ".png"; }
// What each photo is filled with, so that one taken for another is seen.
gart::u8 gray_of(int i) { return static_cast<gart::u8>(40 + 20 * i); }

// A COLMAP capture in text: cameras at (0, 0, -4 - i) that look along z, and points.
struct colmap_text {
  std::string lens = "1 RADIAL 24 18 20 12 9 0 0", end = "\n", line_of_points = "\n", before;
  std::string points = "1 0.5 0 1 255 0 0 0\n2 -0.5 0.25 1 0 255 0 0\n3 0 0 1.5 0 0 255 0\n";
  std::function<std::string(int)> name = name_of;
  std::string model = "sparse/0", photos = "images";
  int count = views;

  void write(fs::path const& at) const {
    auto const put = [&](std::string const& file, std::string text) {
      fs::create_directories(at / model);
      if (end != "\n")
        for (std::size_t k = 0; (k = text.find('\n', k)) != std::string::npos; k += end.size()) text.replace(k, 1, end);
      gart::write_file(at / model / file, before + text);
    };
    put("cameras.txt", "# Cameras\n" + lens + "\n");
    std::string images = "# Images\n";
    for (int i = 0; i < count; ++i)
      images +=
          std::to_string(i + 1) + " 1 0 0 0 0 0 " + std::to_string(4 + i) + " 1 " + name(i) + "\n" + line_of_points;
    put("images.txt", images);
    if (!points.empty()) put("points3D.txt", points);
    write_photos(at / photos);
  }
  static void write_photos(fs::path const& folder) {
    fs::create_directories(folder);
    for (int i = 0; i < views; ++i) gart::write_png(folder / name_of(i), gart::image8(width, height, 3, gray_of(i)));
  }
};

gart::dataset load(fs::path const& path, bool masks = true) {
  gart::dataset_options options;
  options.test_every = 0, options.masks = masks;
  return gart::load_dataset(path, options);
}

std::string notes_of(gart::dataset const& data) {
  std::string all;
  for (auto const& note : data.notes) all += note + "\n";
  return all;
}

// Each camera has its own photo, whatever their names.
void check_views(gart::dataset const& data, int count = views) {
  REQUIRE(static_cast<int>(data.train.size()) == count);
  for (auto const& v : data.train) {
    int const i = static_cast<int>(std::lround(-v.view.position.z)) - 4;
    REQUIRE(i >= 0);
    REQUIRE(i < views);
    CHECK(v.image.at(3, 3, 1) == gray_of(i));
    CHECK(v.view.width == v.image.width);
  }
}

std::string refused(std::function<void()> const& f) {
  try {
    f();
  } catch (gart::error const& e) {
    return e.what();
  }
  return "";
}

// A transforms.json of the same views; `odd` stands in the third pose.
std::string transforms(std::string const& odd, std::string const& more = "") {
  std::string text = "{\"fl_x\": 20, \"w\": 24, \"h\": 18" + more + ", \"frames\": [";
  for (int i = 0; i < views; ++i)
    text += std::string(i ? "," : "") + "{\"file_path\": \"images/" + name_of(i) +
            "\", \"transform_matrix\": [[1,0,0," + (i == 2 ? odd : "0") + "],[0,-1,0,0],[0,0,-1," +
            std::to_string(-4 - i) + "],[0,0,0,1]]}";
  return text + "]}";
}

gart::gaussian_model ball(std::size_t n, int degree = 1) {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(n, degree);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t c = 0; c < 3; ++c) m.mean[3 * i + c] = 0.4f * std::clamp(normal(random), -3.0f, 3.0f);
  for (float& v : m.log_scale) v = -2.5f + 0.3f * normal(random);
  for (float& v : m.quaternion) v = normal(random);
  for (float& v : m.opacity) v = 1 + normal(random);
  for (float& v : m.sh) v = 0.3f * std::clamp(normal(random), -3.0f, 3.0f);
  return m;
}

double psnr(fs::path const& a, fs::path const& b) {
  double sum = 0, n = 0;
  for (auto const& file : fs::directory_iterator(a)) {
    gart::image8 const x = gart::read_image(file.path()), y = gart::read_image(b / file.path().filename());
    REQUIRE(x.data.size() == y.data.size());
    for (std::size_t i = 0; i < x.data.size(); ++i, ++n) sum += (x.data[i] - y.data[i]) * (x.data[i] - y.data[i]);
  }
  REQUIRE(n > 0);
  return 10 * std::log10(255 * 255 / std::max(sum / n, 1e-9));
}

}  // namespace

TEST_CASE("captures as people have them") {
  folder const here;
  fs::path const at = here / "capture";
  colmap_text c;
  SUBCASE("plain") {
    c.write(at);
    auto const data = load(at);
    check_views(data);
    CHECK(data.points.size() == 3);
    CHECK(notes_of(data) == "");
  }
  SUBCASE("names of another system") {
    c.name = [](int i) { return "cam0\\" + name_of(i); };
    c.photos = "images/cam0";
    c.write(at);
    check_views(load(at));
    CHECK(load(at).train[0].name == "cam0_view_00");
  }
  SUBCASE("names in other case, with other endings, with other folders before them") {
    for (auto const& other : std::vector<std::function<std::string(int)>>{
             [](int i) { return "VIEW_0" + std::to_string(i) + ".PNG"; },
             [](int i) { return "view_0" + std::to_string(i) + ".jpeg"; },
             [](int i) { return "./images/" + name_of(i); }, [](int i) { return "/home/who/set/images/" + name_of(i); },
             [](int i) { return "C:\\set\\images\\" + name_of(i); }, [](int i) { return "images_2/" + name_of(i); }}) {
      CAPTURE(other(0));
      c.name = other;
      c.write(at);
      check_views(load(at));
      CHECK(has(notes_of(load(at)), "6 photos found by another name: first, " + other(0)));
    }
    // Of two that could be meant, none is taken; nor one that is another frame's.
    c.name = [](int i) { return "b/" + name_of(i); };
    c.write(at);
    fs::rename(at / "images", at / "old");
    colmap_text::write_photos(at / "images/a/b");
    colmap_text::write_photos(at / "images/c/b");
    std::string const what = refused([&] { load(at); });
    CHECK_MESSAGE(has(what, "looked for in"), what);
    fs::remove_all(at / "images/c");
    check_views(load(at));
    c.name = [](int i) { return i < 5 ? name_of(i) : "sub/view_00.png"; };
    c.write(at);
    CHECK(load(at).train.size() == 5);
    CHECK(has(notes_of(load(at)), "1 of 6 frames skipped: no photo is there, such as sub/view_00.png"));
  }
  SUBCASE("a name that is not there: what is looked for, and what is near") {
    c.name = [](int i) { return i == 4 ? "view_4.png" : name_of(i); };
    c.write(at);
    auto const data = load(at);
    check_views(data, 5);
    CHECK(has(notes_of(data), "view_4.png"));
    CHECK(has(notes_of(data), "the most alike view_04.png"));
    c.name = [](int i) { return "photo" + std::to_string(i) + ".png"; };
    c.write(at);
    CHECK(has(refused([&] { load(at); }), "none of the 6 images it lists is there, such as photo0.png, looked for in"));
  }
  SUBCASE("the folder is said") {
    c.photos = "elsewhere";
    c.write(at);
    gart::dataset_options options;
    options.test_every = 0, options.photos = at / "elsewhere";
    check_views(gart::load_dataset(at, options));
    auto const run = here.gart(
        "train capture --photos capture/elsewhere --no-masks --out run --iterations 1 --backend serial --max-gaussians "
        "40");
    CHECK_MESSAGE(run.code == 0, run.err);
    CHECK(here.gart("eval run/model.ply capture --photos capture/elsewhere --out s.json --backend serial").code == 0);
    CHECK(has(here.gart("eval run/model.ply capture --out s.json --backend serial").err, "--photos"));
    options.photos = at / "nowhere";
    CHECK(has(refused([&] { gart::load_dataset(at, options); }), "nowhere: is no folder"));
  }
  SUBCASE("a byte order mark, and the ends of lines") {
    c.before = "\xef\xbb\xbf";
    for (char const* end : {"\r\n", "\n", "\r"}) {
      c.end = end;
      c.write(at);
      check_views(load(at));
      CHECK(load(at).points.size() == 3);
    }
    gart::write_file(at / "sparse/0/cameras.txt", std::string("\xff\xfe#\0\n\0", 6));
    CHECK(has(refused([&] { load(at); }), "save it as UTF-8"));
    c.write(at);
    std::string const json = transforms("0");
    fs::remove_all(at / "sparse");
    gart::write_file(at / "transforms.json", "\xef\xbb\xbf" + json);
    check_views(load(at));
  }
  SUBCASE("a parameter too many") {
    c.lens = "1 RADIAL 24 18 20 12 9 0 0 0.3";
    c.write(at);
    std::string const what = refused([&] { load(at); });
    CHECK_MESSAGE(has(what, "cameras.txt, line 2: camera 1, RADIAL of 5 parameters, is followed by '0.3'"), what);
    auto const run = here.gart("train capture --out run --iterations 1 --backend serial");
    CHECK(run.code == 1);
    CHECK(has(run.err, "RADIAL"));
  }
  SUBCASE("no lines of points, or some") {
    for (char const* line : {"", "\n", "1 2 -1 3 4 7\n"}) {
      c.line_of_points = line;
      c.write(at);
      check_views(load(at));
    }
    c.line_of_points = "1 2 -1 3\n";
    c.write(at);
    CHECK(has(refused([&] { load(at); }), "images.txt, line 3"));
    // A name may be a number.
    c.line_of_points = "", c.name = [](int i) { return std::to_string(i); };
    c.write(at);
    for (int i = 0; i < views; ++i)
      fs::rename(at / "images" / name_of(i), at / "images" / (std::to_string(i) + ".png"));
    check_views(load(at));
  }
  SUBCASE("other folders of photos") {
    for (char const* photos : {"images_4", "input", "images_8", "Images"}) {
      fs::remove_all(at);
      c.photos = photos;
      c.write(at);
      check_views(load(at));
      CHECK(has(notes_of(load(at)), "the photos are those of"));
    }
    // An empty folder of the usual name is not taken for them; the larger copies are.
    c.photos = "images_2";
    c.write(at);
    fs::create_directories(at / "images");
    CHECK(has(notes_of(load(at)), "images_2"));
    // Named in a transforms.json.
    fs::remove_all(at / "sparse");
    gart::write_file(at / "transforms.json", transforms("0"));
    check_views(load(at));
  }
  SUBCASE("colmap/sparse/0") {
    c.model = "colmap/sparse/0";
    c.write(at);
    check_views(load(at));
    check_views(load(at / "colmap/sparse/0/cameras.txt"));
  }
  SUBCASE("of several models the largest") {
    c.count = 2;
    c.write(at);
    c.count = views, c.model = "sparse/1";
    c.write(at);
    check_views(load(at));
    CHECK(has(notes_of(load(at)), "sparse has 2 models (0 of 2 images, 1 of 6 images): 1 is used"));
    check_views(load(at / "sparse/0/images.txt"), 2);
  }
  SUBCASE("points of another format") {
    std::string const text = c.points;
    c.points = "";
    c.write(at);
    CHECK(load(at).points.size() == 0);
    gart::write_point_ply(at / "sparse/0/points3D.ply", {{1, 2, 3, 4, 5, 6}, {9, 9, 9, 8, 8, 8}});
    auto const data = load(at);
    CHECK(data.points.position == std::vector<float>{1, 2, 3, 4, 5, 6});
    CHECK(data.points.color[3] == 8);
    CHECK(has(notes_of(data), "points3D.ply"));
    gart::write_file(at / "sparse/0/points3D.bin", std::string(8, '\0'));
    CHECK(load(at).points.size() == 2);
    gart::write_file(at / "sparse/0/points3D.txt", text);
    CHECK(load(at).points.size() == 3);
  }
  SUBCASE("masks beside the photos") {
    c.write(at);
    gart::image8 mask(width, height, 1, 255);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width / 2; ++x) mask.at(x, y, 0) = 0;
    for (char const* ending : {".png", ""}) {
      fs::remove_all(at / "masks");
      fs::create_directories(at / "masks");
      for (int i = 0; i < views; ++i) gart::write_png(at / "masks" / (name_of(i) + ending), mask);
      auto const data = load(at);
      check_views(data);
      for (auto const& v : data.train) {
        REQUIRE_FALSE(v.mask.empty());
        CHECK(v.mask.at(0, 5, 0) == 0);
        CHECK(v.mask.at(width - 1, 5, 0) == 255);
      }
      CHECK(has(notes_of(data), "6 of 6 frames have a mask"));
      CHECK(load(at, false).train[0].mask.empty());
    }
    auto const run = here.gart("train capture --out run --iterations 1 --backend serial --max-gaussians 40");
    CHECK(run.code == 0);
    CHECK_MESSAGE(has(run.err, "masks 5 of 5"), run.err);
    // A mask of the full size beside smaller copies.
    gart::image8 large(2 * width, 2 * height, 1, 255);
    large.at(0, 0, 0) = large.at(1, 0, 0) = large.at(0, 1, 0) = large.at(1, 1, 0) = 0;
    for (int i = 0; i < views; ++i) gart::write_png(at / "masks" / name_of(i), large);
    auto const data = load(at);
    CHECK(data.train[0].mask.at(0, 0, 0) == 0);
    CHECK(data.train[0].mask.at(1, 1, 0) == 255);
  }
  SUBCASE("names that a terminal would obey") {
    c.name = [](int i) { return i == 0 ? "\x1b[31mred\xc2\x9b" : name_of(i); };
    c.write(at);
    auto const some = here.gart("train capture --out run --iterations 1 --backend serial --max-gaussians 40");
    CHECK(some.code == 0);
    c.name = [](int i) { return "\x1b[31mred" + std::to_string(i); };
    c.write(at);
    auto const none = here.gart("train capture --out run --iterations 1");
    CHECK(none.code == 1);
    for (auto const& run : {some, none}) {
      CHECK(run.err.find('\x1b') == std::string::npos);
      CHECK(run.err.find("\xc2\x9b") == std::string::npos);
      CHECK_MESSAGE(has(run.err, "\\x1b[31mred"), run.err);
    }
  }
  SUBCASE("words that programs have for the same") {
    colmap_text::write_photos(at / "images");
    gart::write_file(at / "transforms.json", transforms("0", ", \"camera_model\": \"opencv\", \"k1\": 0.01"));
    check_views(load(at));
    CHECK(load(at).train[0].view.lens.k1 == 0.01f);
    std::string json = transforms("0");
    json.replace(json.find("\"fl_x\": 20"), 10, "\"camera_angle_y\": 0.8");
    gart::write_file(at / "transforms.json", json);
    auto const data = load(at);
    check_views(data);
    CHECK(data.train[0].view.fy == doctest::Approx(9 / std::tan(0.4)));
    CHECK(data.train[0].view.fx == data.train[0].view.fy);
    // 3DGS' cameras.json.
    gart::write_file(at / "cameras.json",
                     R"([{"id": 0, "img_name": "view_00", "width": 24, "height": 18, "position": [1, 2, 3],)"
                     R"( "rotation": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]], "fy": 21, "fx": 20}])");
    auto const cameras = gart::load_cameras(at / "cameras.json");
    REQUIRE(cameras.size() == 1);
    CHECK(cameras[0].name == "view_00");
    CHECK(cameras[0].view.fy == 21);
    CHECK(cameras[0].view.cx == 12);
    CHECK(cameras[0].view.cy == 9);
    CHECK(cameras[0].view.position.y == 2);
    CHECK(cameras[0].view.rotation[2].x == 1);
    CHECK(cameras[0].view.rotation[0].z == -1);
  }
  SUBCASE("a pose that is NaN") {
    colmap_text::write_photos(at / "images");
    for (char const* odd : {"NaN", "Infinity", "-Infinity", "1e300"}) {
      gart::write_file(at / "transforms.json", transforms(odd));
      auto const data = load(at);
      check_views(data, 5);
      std::string const note =
          "1 frame of " + (at / "transforms.json").string() + " left out: frame 2 (images/view_02.png)";
      CHECK_MESSAGE(has(notes_of(data), note), notes_of(data));
    }
    gart::write_file(at / "transforms.json", transforms("0", ", \"k1\": NaN, \"text\": \"a NaN \\\" NaN\""));
    CHECK(has(refused([&] { load(at); }), "'k1' is NaN"));
    fs::remove(at / "transforms.json");
    for (char const* pose : {"nan 0 0 0 0 0 5", "1 0 0 0 inf 0 5", "0 0 0 0 0 0 5"}) {
      c.write(at);
      std::string images = text_of(at / "sparse/0/images.txt");
      std::string const sound = "2 1 0 0 0 0 0 5";
      images.replace(images.find(sound), sound.size(), std::string("2 ") + pose);
      gart::write_file(at / "sparse/0/images.txt", images);
      auto const data = load(at);
      check_views(data, 5);
      CHECK(has(notes_of(data), "1 image of"));
      CHECK(has(notes_of(data), "left out: image view_01.png"));
    }
  }
  SUBCASE("a point that is NaN") {
    c.points += "9 nan 0 0 1 1 1 0\n10 0 1e300 0 1 1 1 0\n";
    c.write(at);
    CHECK(load(at).points.size() == 3);
    CHECK(has(notes_of(load(at)), "2 points of"));
    CHECK(has(notes_of(load(at)), "left out: first, point 9 is not finite"));
    fs::remove(at / "sparse/0/points3D.txt");
    for (fs::path const& file : {at / "sparse/0/points3D.ply", at / "points.ply"})
      gart::write_point_ply(file, {{1, nan, 3, 4, 5, 6, 7, 8, inf}, {9, 9, 9, 8, 8, 8, 7, 7, 7}});
    CHECK(load(at).points.position == std::vector<float>{4, 5, 6});
    CHECK(load(at).points.color == std::vector<gart::u8>{8, 8, 8});
    fs::remove_all(at / "sparse");
    gart::write_file(at / "transforms.json", transforms("0", ", \"ply_file_path\": \"points.ply\""));
    CHECK(load(at).points.position == std::vector<float>{4, 5, 6});
    CHECK(has(notes_of(load(at)), "left out: first, vertex 0, property y is NaN"));
  }
  SUBCASE("names too long for files") {
    std::string const deep = "one/of/many/folders/" + std::string(180, 'x') + "/" + std::string(60, 'y');
    c.name = [&](int i) { return deep + "/" + name_of(i); };
    c.photos = "images/" + deep;
    c.write(at);
    auto const run = here.gart("train capture --out run --iterations 1 --backend serial --max-gaussians 40");
    CHECK_MESSAGE(run.code == 0, run.err);
    std::size_t renders = 0;
    for (auto const& file : fs::directory_iterator(here / "run/renders")) {
      ++renders;
      CHECK(file.path().filename().string().size() < 200);
      CHECK(has(file.path().filename().string(), "view_0"));
    }
    CHECK(renders > 0);
  }
}

TEST_CASE("resuming checks the capture and clears a killed run's files") {
  folder const here;
  colmap_text c;
  c.write(here / "capture");
  std::string const small =
      "train capture --out run --iterations 4 --stop-at 2 --backend serial --max-gaussians 40 --quiet";
  REQUIRE(here.gart(small).code == 130);
  auto const resumed = [&](std::string const& what) {
    auto const run = here.gart("train capture --resume --out run --stop-at 2 --quiet");
    CHECK(run.code == (what.empty() ? 130 : 2));
    CHECK_MESSAGE((what.empty() || has(run.err, "its " + what + " are not those")), run.err);
  };
  for (char const* begun : {"run/.model.ply.123-4.tmp", "run/renders/.view_00.png.9-0.tmp", "run/.mine.tmp"})
    gart::write_file(here / begun, "half");
  resumed("");
  CHECK_FALSE(fs::exists(here / "run/.model.ply.123-4.tmp"));
  CHECK_FALSE(fs::exists(here / "run/renders/.view_00.png.9-0.tmp"));
  CHECK(fs::exists(here / "run/.mine.tmp"));
  gart::write_png(here / "capture/images/view_03.png", gart::image8(width, height, 3, 41));
  resumed("images");
  c.lens = "1 RADIAL 24 18 21 12 9 0 0";
  c.write(here / "capture");
  resumed("cameras");
  c.lens = colmap_text().lens, c.name = [](int i) { return i == 2 ? "view_02b.png" : name_of(i); };
  c.write(here / "capture");
  fs::rename(here / "capture/images/view_02.png", here / "capture/images/view_02b.png");
  resumed("names");
  colmap_text().write(here / "capture");
  fs::remove(here / "capture/images/view_02b.png");
  resumed("");
}

TEST_CASE("render takes the background of the run") {
  folder const here;
  colmap_text c;
  c.write(here / "capture");
  REQUIRE(
      here.gart("train capture --out run --iterations 1 --backend serial --max-gaussians 3 --background white --quiet")
          .code == 0);
  auto const corner = [&](std::string const& more) {
    REQUIRE(here.gart("render run/model.ply capture --out images --backend serial --quiet" + more).code == 0);
    return int{gart::read_image(here / "images/view_00.png").at(0, 0, 0)};
  };
  int const white = corner(" --background white"), black = corner(" --background black");
  CHECK(white > black);
  CHECK(corner("") == white);
  CHECK(corner(" --background auto") == white);
  fs::rename(here / "run/model.ply", here / "model.ply");
  REQUIRE(here.gart("render model.ply capture --out images --backend serial --quiet --background auto").code == 0);
  CHECK(int{gart::read_image(here / "images/view_00.png").at(0, 0, 0)} == black);
}

TEST_CASE("models with a Gaussian that is none") {
  folder const here;
  auto const model = ball(300);
  auto const read = [&](std::string const& name, gart::gaussian_model const& m, std::string& notes) {
    gart::write_splat_ply(here / name, m);
    std::vector<std::string> lines;
    auto const back = gart::read_splats(here / name, nullptr, &lines);
    notes.clear();
    for (auto const& line : lines) notes += line;
    return back;
  };
  std::string notes;
  CHECK(read("m.ply", model, notes).size() == 300);
  CHECK(notes == "");
  auto bad = model;
  bad.mean[3 * 17] = nan;
  auto const back = read("nan.ply", bad, notes);
  CHECK(back.size() == 299);
  CHECK(back.mean[3 * 17] == model.mean[3 * 18]);
  CHECK(has(notes, "1 Gaussian of"));
  CHECK(has(notes, "left out: vertex 17, property x is NaN"));
  auto const said = here.gart("convert nan.ply out.ply");
  CHECK(said.code == 0);
  CHECK(has(said.out + said.err, "1 Gaussian of nan.ply left out: vertex 17, property x is NaN"));
  CHECK(gart::read_splat_ply(here / "out.ply").size() == 299);
  bad = model;
  for (std::size_t i = 8; i < 12; ++i) bad.quaternion[i] = 0;
  bad.log_scale[30] = inf;
  CHECK(read("zero.ply", bad, notes).size() == 298);
  CHECK(has(notes, "2 Gaussians of"));

  // What other programs write of opacities of 1 and 0, and of a scale of nothing.
  bad = model;
  bad.opacity[5] = inf, bad.opacity[6] = -inf, bad.log_scale[3 * 7 + 1] = -inf;
  auto const settled = read("inf.ply", bad, notes);
  CHECK(notes == "");
  REQUIRE(settled.size() == 300);
  CHECK(1 / (1 + std::exp(-settled.opacity[5])) == doctest::Approx(1).epsilon(1e-4));
  CHECK(1 / (1 + std::exp(-settled.opacity[6])) == doctest::Approx(0).epsilon(1e-4));
  CHECK(std::exp(settled.log_scale[3 * 7 + 1]) < 1e-20f);
  for (char const* name : {"inf.spz", "inf.sog", "inf.compressed.ply", "inf.splat", "inf.glb"}) {
    CAPTURE(name);
    CHECK(here.gart(std::string("convert inf.ply ") + name).code == 0);
    CHECK(gart::read_splats(here / name).size() == 300);
  }

  // The other readers: a NaN among the numbers of files that keep floats.
  for (char const* name : {"f.splat", "f.glb"}) {
    CAPTURE(name);
    auto odd = model;
    odd.mean[3 * 17] = 12345.5f;
    gart::write_splats(here / name, odd);
    std::string bytes = text_of(here / name);
    float const mark = std::string(name) == "f.glb" ? -12345.5f : 12345.5f;
    std::string const raw(reinterpret_cast<char const*>(&mark), 4), none(reinterpret_cast<char const*>(&nan), 4);
    auto const place = bytes.find(raw);
    REQUIRE(place != std::string::npos);
    gart::write_file(here / name, bytes.replace(place, 4, none));
    std::vector<std::string> lines;
    CHECK(gart::read_splats(here / name, nullptr, &lines).size() == 299);
    REQUIRE(lines.size() == 1);
    CHECK_MESSAGE(has(lines[0], "left out: Gaussian 17, "), lines[0]);
    CHECK(has(here.gart(std::string("convert ") + name + " out.ply").out, "1 Gaussian of"));
  }

  // Commands that show or train it say so too.
  write_capture(here / "capture");
  gart::write_splat_ply(here / "nan.ply", [&] {
    auto m = model;
    m.opacity[3] = nan;
    return m;
  }());
  for (char const* command : {"render nan.ply capture --out images --backend serial",
                              "eval nan.ply capture --out scores.json --backend serial",
                              "train capture --start nan.ply --out run --iterations 1 --backend serial"}) {
    auto const run = here.gart(command);
    CHECK_MESSAGE(run.code == 0, run.err);
    CHECK_MESSAGE(has(run.err, "nan.ply left out: vertex 3, property opacity is NaN"), run.err);
  }
}

TEST_CASE("one Gaussian far away costs others nothing in any format") {
  folder const here;
  write_capture(here / "capture");
  auto near = ball(2400), far = near;
  far.resize(2401, near.sh_degree);
  far.mean[3 * 2400] = 1e6f, far.mean[3 * 2400 + 1] = -3e5f;
  for (std::size_t c = 0; c < 3; ++c) far.log_scale[3 * 2400 + c] = -3;
  far.quaternion[4 * 2400] = 1, far.opacity[2400] = 2;
  gart::write_splat_ply(here / "near.ply", near);
  gart::write_splat_ply(here / "far.ply", far);
  auto const render = [&](std::string const& model) {
    auto const run = here.gart("render " + model + " capture --out of_" + model + " --backend serial --quiet");
    REQUIRE_MESSAGE(run.code == 0, run.err);
  };
  render("near.ply");
  for (std::string const format : {".spz", ".sog", ".compressed.ply"}) {
    CAPTURE(format);
    CHECK_FALSE(has(here.gart("convert near.ply near" + format).out, "the distance of"));
    CHECK(has(here.gart("convert far.ply far" + format).out, "left out: the distance of 1 Gaussian, over 256 times"));
    render("near" + format), render("far" + format);
    double const without = psnr(here / "of_near.ply", here / ("of_near" + format)),
                 with = psnr(here / "of_near.ply", here / ("of_far" + format));
    MESSAGE(format, ": ", without, " dB without, ", with, " dB with");
    CHECK(with > without - 1);
    // It stays far, in its direction.
    auto const back = gart::read_splats(here / ("far" + format));
    float most = 0;
    for (float const v : back.mean) most = std::max(most, v);
    CHECK(most > 2);
  }
}
