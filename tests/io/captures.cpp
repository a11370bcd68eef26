// Real captures: GART_DATA, or data/ beside the source tree's folder. Absent captures are reported, not failed.
#include "support.hpp"

#include <cmath>
#include <cstdlib>

using namespace gart_test;

namespace {

bool find_capture(char const* name, fs::path& path) {
  char const* const given = std::getenv("GART_DATA");
  path = (given ? fs::path(given) : fs::path(GART_SOURCE_DIR) / ".." / "shared" / "data") / name;
  if (fs::exists(path)) return true;
  MESSAGE("skipped: ", path.string(), " is not there (set GART_DATA)");
  return false;
}

gart::dataset_options cameras_only() {
  gart::dataset_options options;
  options.load_images = false;
  return options;
}

// Share of the points that lie in front of the first camera, within its image: tells a wrong pose or axis.
double share_seen(gart::dataset const& data, gart::camera const& c) {
  std::size_t seen = 0;
  for (std::size_t i = 0; i < data.points.size(); ++i) {
    double p[3], x[3] = {};
    for (int k = 0; k < 3; ++k) p[k] = data.points.position[3 * i + static_cast<std::size_t>(k)] - c.position[k];
    for (int k = 0; k < 3; ++k) {
      for (int j = 0; j < 3; ++j) x[k] += double{c.rotation[k][j]} * p[j];
    }
    if (x[2] <= 0) continue;
    double const u = c.fx * x[0] / x[2] + c.cx, v = c.fy * x[1] / x[2] + c.cy;
    seen += u >= 0 && u < c.width && v >= 0 && v < c.height;
  }
  return static_cast<double>(seen) / static_cast<double>(data.points.size());
}

}  // namespace

TEST_CASE("fox: COLMAP beside a transforms.json") {
  fs::path path;
  if (!find_capture("fox", path)) return;
  gart::dataset const data = gart::load_dataset(path, cameras_only());
  CHECK(data.format == "COLMAP");
  CHECK(data.train.size() + data.test.size() == 50);
  CHECK(data.test.size() == 7);
  CHECK(data.points.size() == 15080);
  CHECK(any_note(data, "transforms.json"));
  gart::camera const& c = data.train[0].view;
  CHECK(c.lens.any());
  CHECK(c.lens.p1 != 0);
  CHECK(c.width == 1080);
  CHECK(share_seen(data, c) > 0.1);

  gart::dataset const other = gart::load_dataset(path / "transforms.json", cameras_only());
  CHECK(other.format == "nerfstudio");
  CHECK(other.train.size() + other.test.size() == 50);
  CHECK(any_note(other, "17 of 67 frames skipped"));
  CHECK(other.test[0].name == data.test[0].name);
  CHECK(other.points.size() == 0);
  CHECK(other.train[0].view.lens.k1 == 0.0578421f);
  // The two reconstructions agree up to a similarity: ratios of distances between cameras are the same.
  auto const distance = [](gart::dataset const& d, std::size_t a, std::size_t b) {
    gart::vec3d const v = d.train[a].view.position - d.train[b].view.position;
    return std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
  };
  CHECK(distance(data, 0, 20) / distance(data, 0, 40) ==
        doctest::Approx(distance(other, 0, 20) / distance(other, 0, 40)).epsilon(0.02));
}

TEST_CASE("tandt_train: COLMAP, with its photos") {
  fs::path path;
  if (!find_capture("tandt_train", path)) return;
  gart::dataset_options options;
  options.downscale = 4;
  gart::dataset const data = gart::load_dataset(path, options);
  CHECK(data.train.size() == 263);
  CHECK(data.test.size() == 38);
  CHECK(data.test[0].name == "00001");
  CHECK(data.points.size() == 107775);
  CHECK_FALSE(data.alpha);
  gart::dataset_view const& v = data.train[0];
  CHECK(v.image.width == 244);
  CHECK(v.image.height == 135);
  CHECK(v.image.channels == 3);
  CHECK(v.view.width == 244);
  CHECK(share_seen(data, v.view) > 0.1);
}

TEST_CASE("many_cameras: as many lenses as photos") {
  fs::path path;
  if (!find_capture("many_cameras", path)) return;
  gart::dataset const data = gart::load_dataset(path, cameras_only());
  CHECK(data.train.size() + data.test.size() == 71);
  CHECK(data.points.size() == 4414);
  std::size_t differing = 0;
  for (gart::dataset_view const& v : data.train) {
    CHECK(v.view.lens.k1 != 0);
    CHECK(v.view.lens.p1 == 0);
    differing += v.view.fx != data.train[0].view.fx;
  }
  CHECK(differing + 1 >= data.train.size());
  CHECK(share_seen(data, data.train[0].view) > 0.1);
}

TEST_CASE("lego: Blender, with alpha") {
  fs::path path;
  if (!find_capture("lego", path)) return;
  gart::dataset_options options;
  options.downscale = 4;
  gart::dataset const data = gart::load_dataset(path, options);
  CHECK(data.format == "Blender");
  CHECK(data.train.size() == 100);
  CHECK(data.test.size() == 25);
  CHECK(data.alpha);
  CHECK(data.train[0].image.width == 200);
  CHECK(data.train[0].image.channels == 4);
  CHECK(data.train[0].view.fx == doctest::Approx(1111.111 / 4).epsilon(1e-4));
  CHECK(data.bounds_min.x == -1.3);
  // The model fills the middle of the first photo, and the corner is empty.
  CHECK(data.train[0].image.at(100, 110, 3) == 255);
  CHECK(data.train[0].image.at(0, 0, 3) == 0);
}
