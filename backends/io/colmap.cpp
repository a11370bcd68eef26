// COLMAP's sparse models: cameras, images and points3D, as .bin and as .txt.
// https://colmap.github.io/format.html

#include "bytes.hpp"
#include "camera_formats.hpp"
#include "capture.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>

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
  point_cloud points;
  std::size_t wild_points = 0;
};

void add_point(model_files& model, std::array<double, 3> const& position, std::array<u8, 3> const& color) {
  bool finite = true;
  for (double v : position) finite = finite && std::isfinite(static_cast<float>(v));
  if (!finite) {
    ++model.wild_points;
    return;
  }
  for (double v : position) model.points.position.push_back(static_cast<float>(v));
  model.points.color.insert(model.points.color.end(), color.begin(), color.end());
}

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

void read_points_bin(fs::path const& path, model_files& model) {
  std::vector<u8> const bytes = read_file(path);
  byte_reader in(bytes, path.string());
  u64 const n = in.count("the number of points", 51);
  model.points.position.reserve(n * 3), model.points.color.reserve(n * 3);
  for (u64 i = 0; i < n; ++i) {
    in.get<u64>("a point's id");
    std::array<double, 3> position;
    std::array<u8, 3> color;
    for (double& v : position) v = in.get<double>("a point's position");
    for (u8& v : color) v = in.get<u8>("a point's colour");
    in.get<double>("a point's error");
    in.skip(in.count("a point's track length", 8) * 8, "a point's track");
    add_point(model, position, color);
  }
}

// A text file by lines, with the line number for errors.
class text_lines {
 public:
  explicit text_lines(fs::path const& path) : file_(path.string()), bytes_(read_file(path)) {
    rest_ = std::string_view(reinterpret_cast<char const*>(bytes_.data()), bytes_.size());
  }
  // The next line that is neither blank nor a comment.
  bool next_record() {
    while (next()) {
      std::string_view probe = line_;
      std::string_view const word = next_word(probe);
      if (!word.empty() && word[0] != '#') return true;
    }
    return false;
  }
  bool next() { return next_line(rest_, line_) && ++number_; }
  std::string_view word(char const* field) {
    std::string_view const w = next_word(line_);
    if (w.empty()) refuse(std::string(field) + " is missing");
    return w;
  }
  template <class T>
  T number(char const* field) {
    std::string_view const w = word(field);
    T value{};
    if (!parse_number(w, value))
      refuse(std::string(field) + " is '" + std::string(w.substr(0, 40)) + "', not a number in range");
    return value;
  }
  std::string rest_of_line(char const* field) {
    while (!line_.empty() && is_space(line_.front())) line_.remove_prefix(1);
    while (!line_.empty() && is_space(line_.back())) line_.remove_suffix(1);
    if (line_.empty()) refuse(std::string(field) + " is missing");
    return std::string(line_);
  }
  [[noreturn]] void refuse(std::string const& what) const {
    throw io_error(file_ + ", line " + std::to_string(number_), what,
                   "the file is truncated or damaged: export it again");
  }

 private:
  std::string file_;
  std::vector<u8> bytes_;
  std::string_view rest_, line_;
  std::size_t number_ = 0;
};

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
    model.sensors[id] = s;
  }
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
    in.next();  // its points, which may be an empty line
  }
}

void read_points_txt(fs::path const& path, model_files& model) {
  text_lines in(path);
  while (in.next_record()) {
    in.number<u64>("a point's id");
    std::array<double, 3> position;
    std::array<u8, 3> color;
    for (double& v : position) v = in.number<double>("a point's position");
    for (u8& v : color) v = in.number<u8>("a point's colour");
    in.number<double>("a point's error");
    add_point(model, position, color);
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
    throw io_error(where, "its rotation is not a finite quaternion other than zero", "remove the image from the model");
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

// The photos lie in images/ beside the model or up to two folders above it.
std::optional<fs::path> image_folder(fs::path const& model) {
  std::error_code ignored;
  fs::path const base = fs::absolute(model, ignored).lexically_normal();
  fs::path folder = base.has_filename() ? base : base.parent_path();
  for (int up = 0; up < 3; ++up, folder = folder.parent_path()) {
    if (fs::is_directory(folder / "images", ignored)) return folder / "images";
  }
  return std::nullopt;
}

}  // namespace

bool has_colmap_model(fs::path const& folder, bool text) {
  std::error_code ignored;
  return fs::is_regular_file(file_of(folder, "cameras", text), ignored) ||
         fs::is_regular_file(file_of(folder, "images", text), ignored);
}

capture read_colmap(fs::path const& folder, bool text) {
  capture result;
  result.source = folder;
  result.format = "COLMAP";
  model_files model;
  (text ? read_cameras_txt : read_cameras_bin)(file_of(folder, "cameras", text), model);
  (text ? read_images_txt : read_images_bin)(file_of(folder, "images", text), model);
  std::error_code ignored;
  fs::path const points = file_of(folder, "points3D", text);
  if (fs::exists(points, ignored)) {
    (text ? read_points_txt : read_points_bin)(points, model);
  } else {
    result.notes.push_back(points.string() + " is not there: training starts at random points");
  }
  if (model.wild_points) {
    result.notes.push_back(counted(model.wild_points, "point") + " of " + points.string() + " left out: not finite");
  }
  auto const photos = image_folder(folder);
  if (!photos) result.notes.push_back("there is no folder images beside " + folder.string() + " or above it");

  fs::path const images = file_of(folder, "images", text);
  for (pose const& p : model.poses) {
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
    set_world_to_camera(f.view, p, where);
    check_camera(f.view, lens_place);
    if (photos && fs::is_regular_file(*photos / p.name, ignored)) f.photo = *photos / p.name;
    result.frames.push_back(std::move(f));
  }
  result.points = std::move(model.points);
  return result;
}

}  // namespace gart::io
