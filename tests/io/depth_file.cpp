// Depth maps: there and back, what is refused and by which message, and their way into a capture.
#include "support.hpp"

#include <gart/io/depth_file.hpp>

#include <cmath>
#include <cstring>

using namespace gart_test;

namespace {

gart::image_float ramp(int w, int h) {
  gart::image_float map(w, h, 1);
  for (std::size_t i = 0; i < map.data.size(); ++i) map.data[i] = 0.25f * static_cast<float>(i);
  return map;
}

// A .npy file of that dictionary and those values.
std::string npy(std::string const& dictionary, std::vector<float> const& values) {
  std::string bytes("\x93NUMPY\x01\x00", 8);
  bytes += {static_cast<char>(dictionary.size()), '\0'};
  bytes += dictionary;
  bytes.append(reinterpret_cast<char const*>(values.data()), 4 * values.size());
  return bytes;
}

std::string refusal(fs::path const& path) {
  return error_of([&] { gart::read_depth(path); });
}

gart::dataset_options view_options() {
  gart::dataset_options options;
  options.test_every = 0, options.depth.load = true;
  return options;
}

// One view that looks along z, 90 degrees wide, with a map of ones.
struct one_view {
  scratch_folder folder;
  gart::dataset_options options = view_options();
  explicit one_view(std::string const& keys = "", std::string const& of_frame = "") {
    folder.put("transforms.json", "{\"fl_x\": 4, \"cx\": 4, \"cy\": 4, \"w\": 8, \"h\": 8" + keys +
                                      ", \"frames\": [{\"file_path\": \"images/a.png\", \"transform_matrix\": "
                                      "[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]" +
                                      of_frame + "}]}");
    folder.put_image("images/a.png", 8, 8, 3);
    fs::create_directories(folder.path / "depths");
  }
  gart::image_float map() const { return gart::load_dataset(folder.path, options).train.at(0).depth; }
  std::string refused() const {
    return error_of([&] { map(); });
  }
};

}  // namespace

TEST_CASE("a depth map goes there and back") {
  scratch_folder const folder;
  auto const map = ramp(7, 5);
  gart::write_depth_png(folder.path / "a.png", map, 0.01);
  auto const png = gart::read_depth(folder.path / "a.png", 0.01);
  REQUIRE(png.width == 7);
  REQUIRE(png.height == 5);
  for (std::size_t i = 0; i < map.data.size(); ++i) CHECK(png.data[i] == doctest::Approx(map.data[i]).epsilon(1e-6));
  CHECK(gart::read_depth(folder.path / "a.png").data[4] == doctest::Approx(0.1));  // 100 steps of 0.001

  gart::write_npy(folder.path / "a.npy", map);
  auto const same = gart::read_depth(folder.path / "a.npy");
  CHECK(same.width == 7);
  CHECK(same.data == map.data);
  CHECK(gart::read_depth(folder.path / "a.npy", 2).data[3] == 1.5f);
  auto bytes = gart::read_file(folder.path / "a.npy");
  CHECK((bytes.size() - 4 * map.data.size()) % 64 == 0);

  // What no 16 bits hold, and what is no depth.
  gart::image_float odd(4, 1, 1);
  odd.data = {-1, NAN, 1e9f, 2};
  gart::write_depth_png(folder.path / "odd.png", odd, 1);
  CHECK(gart::read_depth(folder.path / "odd.png", 1).data == std::vector<float>{0, 0, 65535, 2});
}

TEST_CASE("an impossible depth map is refused by its fault") {
  scratch_folder const folder;
  auto const says = [&](std::string const& bytes) { return refusal(folder.put("a.npy", bytes)); };
  std::string const good = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2), }";
  CHECK(says(npy(good, {1, 2})) == "");
  CHECK(says(npy("{'descr': '<f4', 'fortran_order': False, 'shape': (1, 2, 1), }", {1, 2})) == "");
  CHECK(holds(says(npy(good, {1, NAN})), "row 0, column 1 is not finite"));
  CHECK(holds(says(npy(good, {1, -2})), "row 0, column 1 is negative"));
  CHECK(holds(says(npy(good, {1})), "holds 4 bytes of values where 'shape' needs 8"));
  CHECK(holds(says(npy("{'descr': '<f8', 'fortran_order': False, 'shape': (1, 1), }", {1, 2})), "'descr'"));
  CHECK(holds(says(npy("{'descr': '<f4', 'fortran_order': True, 'shape': (1, 2), }", {1, 2})), "'fortran_order'"));
  CHECK(holds(says(npy("{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }", {1, 2})), "'shape'"));
  CHECK(holds(says(npy("{'descr': '<f4', 'fortran_order': False}", {1, 2})), "'shape'"));
  CHECK(holds(says(npy(good, {1, 2}).substr(0, 30)), "truncated"));
  CHECK(holds(says("neither"), "neither a PNG nor a .npy"));
  folder.put_image("eight.png", 4, 4, 1);
  CHECK(holds(refusal(folder.path / "eight.png"), "not one channel of 16 bits"));
}

TEST_CASE("a capture's depth maps are distances along the rays") {
  one_view const flat;
  gart::write_depth_png(flat.folder.path / "depths" / "a.png", gart::image_float(8, 8, 1, 2.0f), 0.001);
  auto const z = flat.map();
  REQUIRE(z.width == 8);
  // The ray of pixel (0, 3) has the slopes -3.5 / 4 and -0.5 / 4.
  CHECK(z.at(0, 3, 0) == doctest::Approx(2 * std::sqrt(1 + (3.5 * 3.5 + 0.25) / 16)));
  gart::dataset_options unasked;
  unasked.test_every = 0;
  CHECK(gart::load_dataset(flat.folder.path, unasked).train[0].depth.empty());

  one_view round(R"(, "depth_kind": "distance", "depth_unit_scale_factor": 0.5)",
                 R"(, "depth_file_path": "maps/far.png")");
  fs::create_directories(round.folder.path / "maps");
  gart::image_float map(8, 8, 1, 3.0f);
  map.at(1, 1, 0) = 0, map.at(5, 1, 0) = 7;
  gart::write_depth_png(round.folder.path / "maps" / "far.png", map, 0.5);
  CHECK(round.map().data == map.data);
  round.options.depth.unit = 1;
  CHECK(round.map().at(0, 0, 0) == 6);
  round.options.depth.kind = gart::depth_kind::z;
  CHECK(round.map().at(0, 0, 0) > 8);

  // The middle of each block, no mean across it.
  round.options = view_options();
  round.options.downscale = 2;
  auto const half = round.map();
  CHECK(half.width == 4);
  CHECK(half.at(0, 0, 0) == 0);
  CHECK(half.at(2, 0, 0) == 7);
  CHECK(half.at(3, 3, 0) == 3);
}

TEST_CASE("a map of z without a value has no depth on any ray") {
  // To 189 degrees from the axis: behind the camera, and at the corners past what a fisheye has rays for.
  one_view const wide(R"(, "camera_model": "OPENCV_FISHEYE", "fl_y": 1.5, "k1": 0)");
  std::string text;
  for (gart::u8 const c : gart::read_file(wide.folder.path / "transforms.json")) text += static_cast<char>(c);
  text.replace(text.find("\"fl_x\": 4"), 9, "\"fl_x\": 1.5");
  wide.folder.put("transforms.json", text);
  gart::image_float map(8, 8, 1, 0.0f);
  map.at(4, 4, 0) = 2;
  gart::write_depth_png(wide.folder.path / "depths" / "a.png", map, 0.001);
  auto const got = wide.map();
  for (int y = 0; y < 8; ++y)
    for (int x = 0; x < 8; ++x) CHECK((x == 4 && y == 4 ? got.at(x, y, 0) > 2 : got.at(x, y, 0) == 0));
}

TEST_CASE("a depth map that does not fit is refused by file") {
  one_view const view;
  CHECK(holds(view.refused(), "a.png: the depth map of images/a.png is not there"));
  gart::write_npy(view.folder.path / "depths" / "a.npy", gart::image_float(8, 7, 1, 1.0f));
  CHECK(holds(view.refused(), "a.npy: the depth map is 8 x 7 pixels, its photo 8 x 8"));
  gart::write_npy(view.folder.path / "depths" / "a.npy", gart::image_float(8, 8, 1, 1.0f));
  CHECK(view.refused() == "");
  CHECK(holds(one_view(R"(, "depth_kind": "inverse")").refused(), "'depth_kind' is neither 'z' nor 'distance'"));
  CHECK(holds(one_view(R"(, "depth_unit_scale_factor": 0)").refused(), "'depth_unit_scale_factor' is not positive"));
  CHECK(holds(one_view("", R"(, "depth_file_path": "gone.npy")").refused(), "gone.npy"));
}
