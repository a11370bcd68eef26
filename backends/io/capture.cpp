#include "capture.hpp"

#include <gart/core/error.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <set>
#include <system_error>

namespace gart::io {
namespace fs = std::filesystem;

void frame::set_size(int width, int height) {
  view.width = width, view.height = height;
  if (angle_x > 0) view.fx = static_cast<float>(0.5 * width / std::tan(0.5 * angle_x));
  if (angle_y > 0) {
    view.fy = static_cast<float>(0.5 * height / std::tan(0.5 * angle_y));
  } else if (angle_x > 0) {
    view.fy = view.fx;
  }
  if (center_x) view.cx = 0.5f * static_cast<float>(width);
  if (center_y) view.cy = 0.5f * static_cast<float>(height);
}

void check_camera(camera const& c, std::string const& where) {
  if (camera_fault const fault = fault_of(c); fault.what) throw io_error(where, fault.what, fault.remedy);
  // A distorted pinhole that folds can still be traced along its rays (runtime/choose.hpp says so).
  bool const bends = c.kind != camera_kind::perspective || c.lens.more();
  if (bends && !visit_camera(c, [](auto const& model) { return model.one_to_one(); }))
    throw io_error(where, "the lens is not one to one over a quarter of its image or more",
                   "correct its parameters (k1 and what else the model has), or calibrate it again");
}

void set_pose(camera& view, mat3d const& axes, vec3d const& center, std::string const& where) {
  auto const dot = [](vec3d const& a, vec3d const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  auto const cross = [](vec3d const& a, vec3d const& b) {
    return vec3d(a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x);
  };
  double const length[3] = {std::sqrt(dot(axes[0], axes[0])), std::sqrt(dot(axes[1], axes[1])),
                            std::sqrt(dot(axes[2], axes[2]))};
  // Past this the squares of distances leave the range of a float.
  constexpr double farthest = 1e18;
  bool finite = true;
  for (int i = 0; i < 3; ++i) finite = finite && std::isfinite(length[i]) && std::abs(center[i]) <= farthest;
  if (!finite) {
    throw io_error(where, "the pose is not finite, or farther than 1e18 from the origin",
                   "remove the image, or correct its pose");
  }
  bool rotation = length[0] > 1e-12;
  for (int i = 1; i < 3; ++i) rotation = rotation && std::abs(length[i] - length[0]) <= 1e-2 * length[0];
  if (rotation) {
    vec3d const x = axes[0] / length[0];
    vec3d y = axes[1] / length[1];
    vec3d const z = axes[2] / length[2];
    rotation = std::abs(dot(x, y)) < 1e-2 && std::abs(dot(x, z)) < 1e-2 && std::abs(dot(y, z)) < 1e-2 &&
               dot(cross(x, y), z) > 0;
    y = y - x * dot(x, y);
    y = y / std::sqrt(dot(y, y));
    view.rotation = mat3(mat3d(x, y, cross(x, y)));
  }
  if (!rotation) {
    throw io_error(where, "the pose is not a rotation (its columns are not the axes of a right-handed frame)",
                   "correct the pose");
  }
  view.position = center;
}

void make_file_names(std::vector<std::string*> const& names) {
  std::set<std::string> taken;
  std::map<std::string, int> copies;  // of a name, so that a thousand of them are not each tried again
  for (std::string* name : names) {
    std::string path = *name, flat;
    std::replace(path.begin(), path.end(), '\\', '/');
    fs::path parts = fs::path(path).relative_path().lexically_normal();
    std::string const extension = parts.extension().string();
    for (char const* known : {".png", ".jpg", ".jpeg", ".PNG", ".JPG", ".JPEG"}) {
      if (extension == known) parts.replace_extension();
    }
    bool first = true;
    for (fs::path const& part : parts) {
      std::string const text = part.string();
      if (text.empty() || text == "." || text == ".." || (first && text == "images" && part != parts.filename()))
        continue;
      if (!flat.empty()) flat += '_';
      flat += text;
      first = false;
    }
    for (char& c : flat) {
      bool const fit =
          std::isalnum(static_cast<unsigned char>(c)) || c == '.' || c == '-' || c == '_' || static_cast<u8>(c) >= 0x80;
      if (!fit) c = '_';
    }
    if (flat.empty() || flat[0] == '.') flat.insert(0, "view");
    // NAME_truth is the true picture beside a render.
    std::string unique = flat;
    while (taken.count(unique) || taken.count(unique + "_truth"))
      unique = flat + "_" + std::to_string(++copies[flat] + 1);
    taken.insert(unique), taken.insert(unique + "_truth");
    *name = unique;
  }
}

capture read_capture(fs::path const& path) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) throw io_error(path.string(), "there is no such file or folder", "check the path");
  if (!fs::is_directory(path, ignored)) {
    std::string const name = path.filename().string(), extension = path.extension().string();
    fs::path const folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (name == "transforms_train.json") return read_blender(folder);
    if (extension == ".json") return read_transforms(path);
    bool const model = path.stem() == "cameras" || path.stem() == "images" || path.stem() == "points3D";
    if (model && (extension == ".bin" || extension == ".txt")) return read_colmap(folder, extension == ".txt");
    throw io_error(path.string(), "is not a capture that gart reads",
                   "name a folder, a transforms.json, or a COLMAP cameras.bin or cameras.txt");
  }
  fs::path const transforms = path / "transforms.json";
  for (fs::path const& folder : {path / "sparse" / "0", path / "sparse", path}) {
    for (bool text : {false, true}) {
      if (!has_colmap_model(folder, text)) continue;
      capture c = read_colmap(folder, text);
      if (fs::exists(transforms, ignored)) {
        c.notes.push_back(
            "both a COLMAP model and transforms.json are there: COLMAP is used, for its points (to use the "
            "other, name " +
            transforms.string() + ")");
      }
      return c;
    }
  }
  if (fs::exists(path / "transforms_train.json", ignored)) return read_blender(path);
  if (fs::exists(transforms, ignored)) return read_transforms(transforms);
  throw io_error(
      path.string(), "holds no capture that gart reads",
      "expected sparse/0 (COLMAP), transforms_train.json (Blender) or transforms.json (nerfstudio, instant-ngp)");
}

}  // namespace gart::io
