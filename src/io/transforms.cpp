// transforms.json of Blender (NeRF-Synthetic), nerfstudio and instant-ngp.
// https://docs.nerf.studio/quickstart/data_conventions.html

#include "bytes.hpp"
#include "camera_formats.hpp"
#include "capture.hpp"
#include "file_names.hpp"
#include "json_record.hpp"

#include <algorithm>
#include <set>

namespace gart::io {
namespace fs = std::filesystem;
namespace {

fs::path from_text(fs::path const& folder, std::string text) {
  std::replace(text.begin(), text.end(), '\\', '/');
  return (folder / fs::path(text)).lexically_normal();
}

void read_lens(record const& r, frame& f) {
  camera_format const* const model = camera_model_of(r, r.flag("is_fisheye") ? "OPENCV_FISHEYE" : "PERSPECTIVE");
  f.view.kind = *model->kind;
  read_lens_members(r, *model, f.view);
  if (f.view.kind == camera_kind::equirectangular) {
    if (r.has("w") != r.has("h")) throw io_error(r.where, "only one of 'w' and 'h' is there", "give both or neither");
    if (r.has("w")) f.set_size(r.size("w"), r.size("h"));
    return;
  }
  if (f.view.kind != camera_kind::perspective) r.at("fl_x");

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
  } else if (!r.has("camera_angle_y")) {
    throw io_error(r.where, "none of 'fl_x', 'camera_angle_x' and 'camera_angle_y' is there", "add one of them");
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

// A map's settings, of a frame or all: the file, the length of a step, and the measured quantity.
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
    names.insert(plain_name(name.get<std::string>()));
  }
  return names;
}

// Adds the frames of one file to `result`.
void read_frames(fs::path const& file, part role, capture& result) {
  json const root = read_json(file);
  record const top{root, nullptr, file.string()};
  if (root.is_array() && !root.empty() && looks_like_camera(root[0]))
    throw io_error(top.where, "is a camera JSON, which has no photographs",
                   "name a capture: its folder, or its transforms.json");
  if (!root.is_object()) throw io_error(top.where, "is not a JSON object", "name a transforms.json");
  if (looks_like_camera(root))
    throw io_error(top.where, "'frames' is missing: this is one camera",
                   "put [ ] round it, for a camera JSON is a list");
  json const& frames = top.at("frames");
  if (!frames.is_array()) throw io_error(top.where, "'frames' is not a list", "export it again");
  auto const train = name_list(top, "train_filenames"), validate = name_list(top, "val_filenames");
  auto test = name_list(top, "test_filenames");
  char const* const test_key = test.empty() ? "val_filenames" : "test_filenames";
  if (test.empty()) test = validate;
  bool const own_split = role == part::unassigned && !train.empty() && !test.empty();
  if (own_split) result.own_split = std::string("the file's own (train_filenames, ") + test_key + ")";

  fs::path const folder = file.parent_path();
  result.photos = folder;
  unusable bad;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    record const r{frames[i], &root, file.string() + ", frame " + std::to_string(i)};
    if (!r.own.is_object()) throw io_error(r.where, "is not a JSON object", "export it again");
    frame f;
    std::string const path = r.text("file_path");
    f.name = path;
    f.role = role;
    std::string const plain = plain_name(path);
    if (own_split) f.role = train.count(plain) ? part::train : test.count(plain) ? part::test : part::left_out;
    if (r.own.contains("mask_path") && !r.own["mask_path"].is_null()) f.mask = from_text(folder, r.text("mask_path"));
    read_depth_fields(r, folder, f);
    read_lens(r, f);
    try {
      read_pose(r, "transform_matrix", true, f.view);
      read_shutter(r, "transform_matrix_end", true, f.view);
    } catch (pose_error const& e) {
      bad.add(i, [&] { return "frame " + std::to_string(i) + " (" + path + "), " + e.fault; });
      continue;
    }
    if (f.view.width) check_camera(f.view, r.where);
    result.frames.push_back(std::move(f));
  }
  if (!bad.records().empty()) bad.others(frames.size(), "frame", file.string(), &result.notes);
  if (top.has("ply_file_path") && result.points.size() == 0)
    result.points = read_exact_points(from_text(folder, top.text("ply_file_path")), &result.notes);
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
  if (result.points.size() == 0 && fs::exists(points, ignored))
    result.points = read_exact_points(points, &result.notes);
  return result;
}

capture read_transforms(fs::path const& file) {
  capture result;
  result.source = file;
  result.format = "nerfstudio";
  read_frames(file, part::unassigned, result);
  return result;
}

}  // namespace gart::io
