// COLMAP's sparse models: cameras, images and points3D, as .bin and as .txt.
// https://colmap.github.io/format.html

#include "bytes.hpp"
#include "camera_formats.hpp"
#include "capture.hpp"
#include "file_names.hpp"
#include "text_lines.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

namespace gart::io {
namespace fs = std::filesystem;
namespace {

struct sensor {
  camera_format const* model = nullptr;
  u64 width = 0, height = 0;
  std::array<double, 16> parameters{};
};

struct pose {
  std::array<double, 4> rotation{};  // world to camera: w, x, y, z
  std::array<double, 3> translation{};
  u32 camera_id = 0;
  std::string name;
};

struct model_files {
  std::map<u32, sensor> sensors;
  std::vector<pose> poses;
};

// Points of a file, and those that are not finite.
struct model_points {
  exact_points cloud;
  std::size_t read = 0;
  unusable bad;

  void add(u64 id, std::array<double, 3> const& position, std::array<u8, 3> const& color) {
    bool finite = true;
    for (double v : position) finite = finite && std::isfinite(static_cast<float>(v));
    if (!finite) bad.add(read, [&] { return "point " + std::to_string(id) + " is not finite"; });
    if (finite) {
      for (double v : position) cloud.position.push_back(v);
      cloud.color.insert(cloud.color.end(), color.begin(), color.end());
    }
    ++read;
  }
};

void read_cameras_bin(fs::path const& path, model_files& model) {
  std::vector<u8> const bytes = read_file(path);
  byte_reader in(bytes, path.string());
  u64 const n = in.count("the number of cameras", 24);
  for (u64 i = 0; i < n; ++i) {
    u32 const id = in.get<u32>("a camera's id");
    sensor s;
    auto const number = in.get<std::int32_t>("a camera's model");
    s.model = camera_format_of(number);
    if (!s.model) {
      throw io_error(path.string(),
                     "camera " + std::to_string(id) + " has the model number " + std::to_string(number) +
                         ", which COLMAP does not define",
                     "the file is damaged or newer than gart: export it again");
    }
    s.width = in.get<u64>("a camera's width");
    s.height = in.get<u64>("a camera's height");
    for (int k = 0; k < s.model->parameters(); ++k) {
      s.parameters[static_cast<std::size_t>(k)] = in.get<double>("a camera's parameters");
    }
    model.sensors[id] = s;
  }
}

void read_images_bin(fs::path const& path, model_files& model) {
  std::vector<u8> const bytes = read_file(path);
  byte_reader in(bytes, path.string());
  u64 const n = in.count("the number of images", 73);
  for (u64 i = 0; i < n; ++i) {
    pose p;
    in.get<u32>("an image's id");
    for (double& v : p.rotation) v = in.get<double>("an image's rotation");
    for (double& v : p.translation) v = in.get<double>("an image's translation");
    p.camera_id = in.get<u32>("an image's camera");
    p.name = in.text("an image's name");
    in.skip(in.count("an image's number of points", 24) * 24, "an image's points");
    model.poses.push_back(std::move(p));
  }
}

void read_points_bin(fs::path const& path, model_points& points) {
  std::vector<u8> const bytes = read_file(path);
  byte_reader in(bytes, path.string());
  u64 const n = in.count("the number of points", 51);
  points.cloud.position.reserve(n * 3), points.cloud.color.reserve(n * 3);
  for (u64 i = 0; i < n; ++i) {
    u64 const id = in.get<u64>("a point's id");
    std::array<double, 3> position;
    std::array<u8, 3> color;
    for (double& v : position) v = in.get<double>("a point's position");
    for (u8& v : color) v = in.get<u8>("a point's colour");
    in.get<double>("a point's error");
    in.skip(in.count("a point's track length", 8) * 8, "a point's track");
    points.add(id, position, color);
  }
}

void read_cameras_txt(fs::path const& path, model_files& model) {
  text_lines in(path);
  while (in.next_record()) {
    u32 const id = in.number<u32>("a camera's id");
    std::string_view const name = in.word("a camera's model");
    sensor s;
    s.model = camera_format_of(name);
    if (!s.model || s.model->number < 0)
      in.refuse("COLMAP has no camera model '" + std::string(name.substr(0, 40)) + "'");
    s.width = in.number<u64>("a camera's width");
    s.height = in.number<u64>("a camera's height");
    for (int k = 0; k < s.model->parameters(); ++k)
      s.parameters[static_cast<std::size_t>(k)] =
          in.number<double>(("the camera's " + std::string(s.model->field(k))).c_str());
    in.end("camera " + std::to_string(id) + ", " + std::string(s.model->name) + " of " +
           std::to_string(s.model->parameters()) + " parameters,");
    model.sensors[id] = s;
  }
}

// Whether a line is one of points, triples of numbers or nothing, and no image whose line comes without one.
bool is_line_of_points(std::string_view line) {
  std::size_t words = 0;
  for (std::string_view word; !(word = next_word(line)).empty(); ++words) {
    double value = 0;
    if (!parse_number(word, value)) return false;
  }
  return words % 3 == 0;
}

void read_images_txt(fs::path const& path, model_files& model) {
  text_lines in(path);
  while (in.next_record()) {
    pose p;
    in.number<u32>("an image's id");
    for (double& v : p.rotation) v = in.number<double>("an image's rotation");
    for (double& v : p.translation) v = in.number<double>("an image's translation");
    p.camera_id = in.number<u32>("an image's camera");
    p.name = in.rest_of_line("an image's name");
    model.poses.push_back(std::move(p));
    if (is_line_of_points(in.ahead())) in.next();
  }
}

void read_points_txt(fs::path const& path, model_points& points) {
  text_lines in(path);
  while (in.next_record()) {
    u64 const id = in.number<u64>("a point's id");
    std::array<double, 3> position;
    std::array<u8, 3> color;
    for (double& v : position) v = in.number<double>("a point's position");
    for (u8& v : color) v = in.number<u8>("a point's colour");
    in.number<double>("a point's error");
    points.add(id, position, color);
  }
}

camera lens_of(sensor const& s, std::string const& where) {
  if (!s.model->kind) {
    throw unsupported(where + ": the camera model is " + std::string(s.model->name) + "; gart traces " +
                      traced_camera_formats() + " (undistort the capture with `colmap image_undistorter`)");
  }
  if (s.width < 1 || s.height < 1 || s.width > 1000000 || s.height > 1000000) {
    throw io_error(
        where, "the camera's size " + std::to_string(s.width) + " x " + std::to_string(s.height) + " is out of range",
        "export the model again");
  }
  camera c;
  c.kind = *s.model->kind;
  c.width = static_cast<int>(s.width), c.height = static_cast<int>(s.height);
  for (int k = 0; k < s.model->parameters(); ++k)
    set_member(c, s.model->member(k), s.parameters[static_cast<std::size_t>(k)]);
  if (c.kind == camera_kind::equirectangular &&
      !(s.parameters[0] == static_cast<double>(s.width) && s.parameters[1] == static_cast<double>(s.height)))
    throw io_error(where, "the size of the EQUIRECTANGULAR model is not the camera's", "export the model again");
  return c;
}

void set_world_to_camera(camera& view, pose const& p, std::string const& where) {
  double norm2 = 0;
  for (double v : p.rotation) norm2 += v * v;
  if (!std::isfinite(norm2) || !(norm2 > 1e-12)) {
    throw pose_error(where, "its rotation is not a finite quaternion other than zero",
                     "remove the image from the model");
  }
  double const s = 1 / std::sqrt(norm2);
  double const w = p.rotation[0] * s, x = p.rotation[1] * s, y = p.rotation[2] * s, z = p.rotation[3] * s;
  // The rows of the world-to-camera rotation are the camera's axes in the world.
  mat3d const axes(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
                   1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
                   1 - 2 * (x * x + y * y));
  vec3d const t(p.translation[0], p.translation[1], p.translation[2]);
  set_pose(view, axes, -(axes * t), where);
}

fs::path file_of(fs::path const& folder, char const* stem, bool text) {
  return folder / (std::string(stem) + (text ? ".txt" : ".bin"));
}

// The folder that the capture's photos lie in or below: that of the model, or up to three above it.
fs::path above_of(fs::path const& model) {
  std::error_code ignored;
  fs::path const base = fs::absolute(model, ignored).lexically_normal();
  return base.has_filename() ? base : base.parent_path();
}

// The folder of photos, beside the model or above it, that has most of the names. Among equals the nearest wins, and
// `images` before its smaller copies.
fs::path photo_folder_of(fs::path const& model, std::vector<pose> const& poses) {
  constexpr int levels = 4;
  constexpr std::size_t asked = 64;
  fs::path best, folder = above_of(model);
  std::size_t most = 0;
  for (int up = 0; up < levels && folder.has_filename(); ++up, folder = folder.parent_path()) {
    // sparse/0 is two below the capture, colmap/sparse/0 three.
    if (up == levels - 1 && above_of(model).parent_path().parent_path().filename() != "colmap") break;
    for (fs::path const& candidate : photo_folders_in(folder)) {
      file_names names(candidate);
      std::size_t found = 0;
      for (std::size_t i = 0; i < std::min(asked, poses.size()); ++i) found += !names.find(poses[i].name).file.empty();
      if (best.empty() || found > most) best = candidate, most = found;
    }
  }
  return best;
}

// The points of a model, beside it: in its own format, the other, or the PLY that other programs leave.
exact_points points_of(fs::path const& folder, bool text, std::vector<std::string>& notes) {
  std::error_code ignored;
  for (bool const kind : {text, !text}) {
    fs::path const file = file_of(folder, "points3D", kind);
    if (!fs::exists(file, ignored)) continue;
    model_points points;
    (kind ? read_points_txt : read_points_bin)(file, points);
    if (!points.bad.records().empty()) points.bad.others(points.read, "point", file.string(), &notes);
    if (points.cloud.size() == 0) continue;
    if (kind != text) notes.push_back("the points are those of " + file.string());
    return std::move(points.cloud);
  }
  fs::path const ply = folder / "points3D.ply";
  if (fs::exists(ply, ignored)) {
    notes.push_back("the points are those of " + ply.string());
    return read_exact_points(ply, &notes);
  }
  fs::path const own = file_of(folder, "points3D", text);
  notes.push_back(own.string() + (fs::exists(own, ignored) ? " has no point" : " is not there") +
                  ": training starts at random points");
  return {};
}

}  // namespace

bool has_colmap_model(fs::path const& folder, bool text) {
  std::error_code ignored;
  return fs::is_regular_file(file_of(folder, "cameras", text), ignored) ||
         fs::is_regular_file(file_of(folder, "images", text), ignored);
}

std::size_t images_in_colmap(fs::path const& folder, bool text) {
  model_files model;
  try {
    (text ? read_images_txt : read_images_bin)(file_of(folder, "images", text), model);
  } catch (io_error const&) {
    return 0;  // which its own reader says, where there is no other model
  }
  return model.poses.size();
}

capture read_colmap(fs::path const& folder, bool text, fs::path const& photos) {
  capture result;
  result.source = folder;
  result.format = "COLMAP";
  model_files model;
  (text ? read_cameras_txt : read_cameras_bin)(file_of(folder, "cameras", text), model);
  fs::path const images = file_of(folder, "images", text);
  (text ? read_images_txt : read_images_bin)(images, model);
  result.points = points_of(folder, text, result.notes);

  result.photos = photos.empty() ? photo_folder_of(folder, model.poses) : photos;
  if (result.photos.empty())
    result.notes.push_back("there is no folder images beside " + folder.string() + " or above it");
  else if (result.photos.filename() != "images")
    result.notes.push_back("the photos are those of " + result.photos.string());
  unusable bad;
  for (std::size_t i = 0; i < model.poses.size(); ++i) {
    pose const& p = model.poses[i];
    std::string const where = images.string() + ", image " + p.name;
    auto const found = model.sensors.find(p.camera_id);
    if (found == model.sensors.end()) {
      throw io_error(
          where, "camera " + std::to_string(p.camera_id) + " is not in " + file_of(folder, "cameras", text).string(),
          "export both files again");
    }
    frame f;
    f.name = p.name;
    std::string const lens_place =
        file_of(folder, "cameras", text).string() + ", camera " + std::to_string(p.camera_id);
    f.view = lens_of(found->second, lens_place);
    try {
      set_world_to_camera(f.view, p, where);
    } catch (pose_error const& e) {
      bad.add(i, [&] { return "image " + p.name + ", " + e.fault; });
      continue;
    }
    check_camera(f.view, lens_place);
    result.frames.push_back(std::move(f));
  }
  if (!bad.records().empty()) bad.others(model.poses.size(), "image", images.string(), &result.notes);
  return result;
}

}  // namespace gart::io
