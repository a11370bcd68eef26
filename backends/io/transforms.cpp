// transforms.json of Blender (NeRF-Synthetic), nerfstudio and instant-ngp, and gart's camera JSON.
// https://docs.nerf.studio/quickstart/data_conventions.html

#include "bytes.hpp"
#include "camera_formats.hpp"
#include "capture.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/io/ply.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <set>

namespace gart::io {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

json read_json(fs::path const& path) {
  std::vector<u8> const bytes = read_file(path);
  try {
    return json::parse(bytes.begin(), bytes.end());
  } catch (json::exception const& e) {
    throw io_error(path.string(), std::string("is not valid JSON: ") + e.what(), "the file is truncated or damaged");
  }
}

// A JSON object, and the one its missing keys are looked up in.
struct record {
  json const& own;
  json const* fallback;
  std::string where;

  json const* find(char const* key) const {
    if (auto const it = own.find(key); it != own.end() && !it->is_null()) return &*it;
    if (!fallback) return nullptr;
    auto const it = fallback->find(key);
    return it != fallback->end() && !it->is_null() ? &*it : nullptr;
  }
  bool has(char const* key) const { return find(key) != nullptr; }
  json const& at(char const* key) const {
    json const* value = find(key);
    if (!value) throw io_error(where, std::string("'") + key + "' is missing", "add it");
    return *value;
  }
  double number(char const* key) const {
    json const& value = at(key);
    if (!value.is_number()) throw io_error(where, std::string("'") + key + "' is not a number", "write a number");
    double const v = value.get<double>();
    if (!std::isfinite(v)) throw io_error(where, std::string("'") + key + "' is not finite", "write a finite number");
    return v;
  }
  double number_or(char const* key, double other) const { return has(key) ? number(key) : other; }
  int size(char const* key) const {
    double const v = number(key);
    if (!(v >= 1 && v <= 1e6)) {
      throw io_error(where, std::string("'") + key + "' is not a size in pixels", "write a number from 1 to 1000000");
    }
    return static_cast<int>(std::lround(v));
  }
  std::string text(char const* key) const {
    json const& value = at(key);
    if (!value.is_string()) throw io_error(where, std::string("'") + key + "' is not a text", "write it in quotes");
    return value.get<std::string>();
  }
  bool flag(char const* key) const {
    json const* value = find(key);
    return value && value->is_boolean() && value->get<bool>();
  }
};

// A 3x4 or 4x4 matrix, row by row, camera to world.
void read_pose(record const& r, char const* key, bool opengl_axes, camera& view) {
  json const& rows = r.at(key);
  auto const refuse = [&] {
    throw io_error(r.where, std::string("'") + key + "' is not a matrix of 4 x 4 numbers", "export it again");
  };
  if (!rows.is_array() || rows.size() < 3 || rows.size() > 4) refuse();
  mat3d axes(1.0);
  vec3d center(0.0);
  for (int i = 0; i < 3; ++i) {
    json const& row = rows[static_cast<std::size_t>(i)];
    if (!row.is_array() || row.size() != 4) refuse();
    for (int j = 0; j < 4; ++j) {
      json const& value = row[static_cast<std::size_t>(j)];
      if (!value.is_number()) refuse();
      (j < 3 ? axes[j][i] : center[i]) = value.get<double>();
    }
  }
  if (opengl_axes) axes[1] = -axes[1], axes[2] = -axes[2];
  set_pose(view, axes, center, r.where);
}

fs::path from_text(fs::path const& folder, std::string text) {
  std::replace(text.begin(), text.end(), '\\', '/');
  return (folder / fs::path(text)).lexically_normal();
}

// The photo of a file_path, which may lack its extension; empty where there is none.
fs::path find_photo(fs::path const& path) {
  std::error_code ignored;
  if (fs::is_regular_file(path, ignored)) return path;
  for (char const* extension : {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"}) {
    fs::path with = path;
    with += extension;
    if (fs::is_regular_file(with, ignored)) return with;
  }
  return {};
}

void read_lens(record const& r, frame& f) {
  std::string const name = r.has("camera_model") ? r.text("camera_model") : "PERSPECTIVE";
  camera_format const* const model = camera_format_of(name);
  if (!model || !model->kind) {
    throw unsupported(r.where + ": the camera model is " + name.substr(0, 60) + "; gart traces " +
                      traced_camera_formats() + " (undistort the capture)");
  }
  if (r.flag("is_fisheye"))
    throw unsupported(r.where + ": 'is_fisheye' is set; gart traces no fisheye lens (undistort the capture)");
  f.view.kind = *model->kind;
  for (char const* key : {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"}) set_field(f.view, key, r.number_or(key, 0));
  for (char const* key : {"k3", "k4", "k5", "k6"}) {
    if (r.number_or(key, 0) != 0) {
      throw unsupported(r.where + ": '" + key +
                        "' is not zero; gart traces the distortion k1 k2 p1 p2 (undistort the capture)");
    }
  }

  auto const angle = [&](char const* key) {
    double const v = r.number_or(key, 0);
    if (r.has(key) && !(v > 0 && v < 3.14159)) {
      throw io_error(r.where, std::string("'") + key + "' is not an angle between 0 and pi", "write it in radians");
    }
    return v;
  };
  if (r.has("fl_x")) {
    f.view.fx = static_cast<float>(r.number("fl_x"));
  } else if (r.has("camera_angle_x")) {
    f.angle_x = angle("camera_angle_x");
  } else {
    throw io_error(r.where, "neither 'fl_x' nor 'camera_angle_x' is there", "add one of them");
  }
  if (r.has("fl_y")) {
    f.view.fy = static_cast<float>(r.number("fl_y"));
  } else if (!r.has("fl_x") && r.has("camera_angle_y")) {
    f.angle_y = angle("camera_angle_y");
  } else {
    f.view.fy = f.view.fx;  // square pixels
  }
  f.center_x = !r.has("cx"), f.center_y = !r.has("cy");
  if (!f.center_x) f.view.cx = static_cast<float>(r.number("cx"));
  if (!f.center_y) f.view.cy = static_cast<float>(r.number("cy"));
  if (r.has("w") != r.has("h")) throw io_error(r.where, "only one of 'w' and 'h' is there", "give both or neither");
  if (r.has("w")) f.set_size(r.size("w"), r.size("h"));
}

// Of a frame or the whole file: the map's file, the length of a step of it, and what it measures.
void read_depth_fields(record const& r, fs::path const& folder, frame& f) {
  if (r.own.contains("depth_file_path") && !r.own["depth_file_path"].is_null())
    f.depth = from_text(folder, r.text("depth_file_path"));
  if (r.has("depth_unit_scale_factor")) {
    f.depth_unit = r.number("depth_unit_scale_factor");
    if (!(f.depth_unit > 0))
      throw io_error(r.where, "'depth_unit_scale_factor' is not positive", "write the length of a step of the maps");
  }
  if (r.has("depth_kind")) {
    f.depth_is = from_string(r.text("depth_kind"), depth_kind::automatic);
    if (f.depth_is == depth_kind::automatic)
      throw io_error(r.where, "'depth_kind' is neither 'z' nor 'distance'", "write one of them");
  }
}

std::set<std::string> name_list(record const& r, char const* key) {
  std::set<std::string> names;
  if (!r.has(key)) return names;
  if (!r.at(key).is_array())
    throw io_error(r.where, std::string("'") + key + "' is not a list", "write a list of file names");
  for (json const& name : r.at(key)) {
    if (!name.is_string())
      throw io_error(r.where, std::string("'") + key + "' holds something that is not a text", "write file names");
    names.insert(name.get<std::string>());
  }
  return names;
}

// The frames of one file, added to `result`.
void read_frames(fs::path const& file, part role, capture& result) {
  json const root = read_json(file);
  record const top{root, nullptr, file.string()};
  if (!root.is_object()) throw io_error(top.where, "is not a JSON object", "name a transforms.json");
  json const& frames = top.at("frames");
  if (!frames.is_array()) throw io_error(top.where, "'frames' is not a list", "export it again");
  auto const train = name_list(top, "train_filenames"), validate = name_list(top, "val_filenames");
  auto test = name_list(top, "test_filenames");
  char const* const test_key = test.empty() ? "val_filenames" : "test_filenames";
  if (test.empty()) test = validate;
  bool const own_split = role == part::unassigned && !train.empty() && !test.empty();
  if (own_split) result.own_split = std::string("the file's own (train_filenames, ") + test_key + ")";

  fs::path const folder = file.parent_path();
  for (std::size_t i = 0; i < frames.size(); ++i) {
    record const r{frames[i], &root, file.string() + ", frame " + std::to_string(i)};
    if (!r.own.is_object()) throw io_error(r.where, "is not a JSON object", "export it again");
    frame f;
    std::string const path = r.text("file_path");
    f.name = path;
    f.photo = find_photo(from_text(folder, path));
    f.role = role;
    if (own_split) f.role = train.count(path) ? part::train : test.count(path) ? part::test : part::left_out;
    if (r.own.contains("mask_path") && !r.own["mask_path"].is_null()) f.mask = from_text(folder, r.text("mask_path"));
    read_depth_fields(r, folder, f);
    read_lens(r, f);
    read_pose(r, "transform_matrix", true, f.view);
    if (f.view.width) check_camera(f.view, r.where);
    result.frames.push_back(std::move(f));
  }
  if (top.has("ply_file_path") && result.points.size() == 0) {
    result.points = read_point_ply(from_text(folder, top.text("ply_file_path")));
  }
}

}  // namespace

capture read_blender(fs::path const& folder) {
  capture result;
  result.source = folder / "transforms_train.json";
  result.format = "Blender";
  result.synthetic_bounds = true;
  std::error_code ignored;
  char const* test = nullptr;
  for (char const* name : {"transforms_val.json", "transforms_test.json"}) {
    if (fs::exists(folder / name, ignored)) test = name;
  }
  read_frames(result.source, test ? part::train : part::unassigned, result);
  if (test) {
    read_frames(folder / test, part::test, result);
    result.own_split = std::string("the files' own (transforms_train.json, ") + test + ")";
  }
  // Where the INRIA reference keeps the points of a Blender scene.
  fs::path const points = folder / "points3d.ply";
  if (result.points.size() == 0 && fs::exists(points, ignored)) result.points = read_point_ply(points);
  return result;
}

capture read_transforms(fs::path const& file) {
  capture result;
  result.source = file;
  result.format = "nerfstudio";
  read_frames(file, part::unassigned, result);
  return result;
}

bool is_json_list(fs::path const& file) {
  for (u8 byte : read_file(file)) {
    if (byte == '[') return true;
    if (!is_space(static_cast<char>(byte)) && byte < 0x80) return false;  // a byte order mark may come first
  }
  return false;
}

std::vector<named_camera> read_camera_json(fs::path const& file) {
  json const root = read_json(file);
  std::vector<named_camera> cameras;
  for (std::size_t i = 0; i < root.size(); ++i) {
    record const r{root[i], nullptr, file.string() + ", camera " + std::to_string(i)};
    if (!r.own.is_object()) throw io_error(r.where, "is not a JSON object", "write {\"name\", \"width\", ...}");
    named_camera c;
    c.name = r.text("name");
    c.view.width = r.size("width"), c.view.height = r.size("height");
    c.view.fx = static_cast<float>(r.number("fx")), c.view.fy = static_cast<float>(r.number("fy"));
    c.view.cx = static_cast<float>(r.number("cx")), c.view.cy = static_cast<float>(r.number("cy"));
    read_pose(r, "c2w", false, c.view);
    check_camera(c.view, r.where);
    cameras.push_back(std::move(c));
  }
  if (cameras.empty()) throw io_error(file.string(), "holds no camera", "add one");
  std::vector<std::string*> names;
  for (named_camera& c : cameras) names.push_back(&c.name);
  make_file_names(names);
  return cameras;
}

}  // namespace gart::io
