#include "capture.hpp"

#include "file_names.hpp"

#include <gart/core/error.hpp>
#include <gart/core/words.hpp>
#include <gart/io/splat_file.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <system_error>

namespace gart::io {
namespace fs = std::filesystem;

void frame::set_size(int width, int height) {
  view.width = width, view.height = height;
  if (angle_x > 0) view.fx = static_cast<float>(0.5 * width / std::tan(0.5 * angle_x));
  if (angle_y > 0) {
    view.fy = static_cast<float>(0.5 * height / std::tan(0.5 * angle_y));
    if (!(angle_x > 0)) view.fx = view.fy;
  } else if (angle_x > 0) {
    view.fy = view.fx;
  }
  if (center_x) view.cx = 0.5f * static_cast<float>(width);
  if (center_y) view.cy = 0.5f * static_cast<float>(height);
}

void check_camera(camera const& c, std::string const& where) {
  if (camera_fault const fault = fault_of(c); fault.what) throw io_error(where, fault.what, fault.remedy);
  // A distorted pinhole that folds can still be traced along its rays (runtime/capture_defaults.hpp says so).
  bool const bends = c.kind != camera_kind::perspective || c.lens.more();
  if (bends && !visit_camera(c, [](auto const& model) { return model.one_to_one(); }))
    throw io_error(where, "the lens is not one to one over a quarter of its image or more",
                   "correct its parameters (k1 and what else the model has), or calibrate it again");
}

void set_pose(camera& view, mat3d const& axes, vec3d const& center, std::string const& where) {
  using glm::cross, glm::dot;
  double const length[3] = {std::sqrt(dot(axes[0], axes[0])), std::sqrt(dot(axes[1], axes[1])),
                            std::sqrt(dot(axes[2], axes[2]))};
  // Past this the squares of distances leave the range of a float.
  constexpr double farthest = 1e18;
  bool finite = true;
  for (int i = 0; i < 3; ++i) finite = finite && std::isfinite(length[i]) && std::abs(center[i]) <= farthest;
  if (!finite) {
    throw pose_error(where, "the pose is not finite, or farther than 1e18 from the origin",
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
    throw pose_error(where, "the pose is not a rotation (its columns are not the axes of a right-handed frame)",
                     "correct the pose");
  }
  view.position = center;
}

namespace {
// File systems take 255 bytes; endings and temporary names need some. The end of a long name tells it from others, its
// start whose it is. No character of UTF-8 is cut.
std::string short_name(std::string name) {
  constexpr std::size_t most = 160, head = 40;
  if (name.size() <= most) return name;
  auto const within = [&](std::size_t at) { return (static_cast<u8>(name[at]) & 0xc0) == 0x80; };
  std::size_t begin = head, end = name.size() - (most - head - 1);
  while (begin > 0 && within(begin)) --begin;
  while (end < name.size() && within(end)) ++end;
  return name.substr(0, begin) + "-" + name.substr(end);
}
}  // namespace

void make_file_names(std::vector<std::string*> const& names) {
  std::set<std::string> taken;
  std::map<std::string, int> copies;  // of a name, so that a thousand of them are not each tried again
  for (std::string* name : names) {
    std::string path = *name, flat;
    std::replace(path.begin(), path.end(), '\\', '/');
    fs::path parts = fs::path(path).relative_path().lexically_normal();
    std::string const extension = parts.extension().string();
    for (char const* known : {".png", ".jpg", ".jpeg", ".webp", ".PNG", ".JPG", ".JPEG", ".WEBP"}) {
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
    flat = short_name(std::move(flat));
    // NAME_truth is the true picture beside a render.
    std::string unique = flat;
    while (taken.count(unique) || taken.count(unique + "_truth"))
      unique = flat + "_" + std::to_string(++copies[flat] + 1);
    taken.insert(unique), taken.insert(unique + "_truth");
    *name = unique;
  }
}

namespace {

struct colmap_place {
  fs::path folder;
  bool text = false;
};

// The model of a folder: binary before text.
std::optional<colmap_place> colmap_in(fs::path const& folder) {
  for (bool text : {false, true})
    if (has_colmap_model(folder, text)) return colmap_place{folder, text};
  return std::nullopt;
}

// COLMAP numbers the parts that it could not join. Takes the part with most images, and notes the others.
std::optional<colmap_place> largest_colmap_below(fs::path const& sparse, std::vector<std::string>& notes) {
  std::error_code code;
  std::vector<fs::path> folders;
  for (fs::directory_iterator at(sparse, code), end; !code && at != end; at.increment(code))
    if (at->is_directory(code)) folders.push_back(at->path());
  std::sort(folders.begin(), folders.end(), [](fs::path const& a, fs::path const& b) {
    std::string const x = a.filename().string(), y = b.filename().string();
    return x.size() != y.size() ? x.size() < y.size() : x < y;
  });
  std::vector<colmap_place> models;
  for (fs::path const& folder : folders)
    if (auto const model = colmap_in(folder)) models.push_back(*model);
  if (models.empty()) return std::nullopt;
  if (models.size() == 1) return models[0];
  std::size_t best = 0, most = 0;
  std::string all;
  for (std::size_t i = 0; i < models.size(); ++i) {
    std::size_t const images = images_in_colmap(models[i].folder, models[i].text);
    if (images > most) best = i, most = images;
    all += (i ? ", " : "") + models[i].folder.filename().string() + " of " + counted(images, "image");
  }
  notes.push_back(sparse.string() + " has " + counted(models.size(), "model") + " (" + all +
                  "): " + models[best].folder.filename().string() + " is used (to use another, name its folder)");
  return models[best];
}

std::optional<colmap_place> colmap_of(fs::path const& capture, std::vector<std::string>& notes) {
  for (fs::path const& sparse : {capture / "sparse", capture / "colmap" / "sparse"}) {
    if (auto const model = largest_colmap_below(sparse, notes)) return model;
    if (auto const model = colmap_in(sparse)) return model;
  }
  for (fs::path const& folder : {capture / "colmap", capture})
    if (auto const model = colmap_in(folder)) return model;
  return std::nullopt;
}

}  // namespace

bool holds_capture(fs::path const& folder) {
  std::vector<std::string> unheard;
  std::error_code ignored;
  return colmap_of(folder, unheard) || fs::exists(folder / "transforms_train.json", ignored) ||
         fs::exists(folder / "transforms.json", ignored);
}

bool holds_training(fs::path const& folder) {
  std::error_code ignored;
  return fs::exists(folder / "model.ply", ignored) || fs::exists(folder / "checkpoint.gart", ignored);
}

namespace {

// Of the folders at most three below, the first by name that holds a capture, such as dense/0; empty without one.
fs::path capture_below(fs::path const& path) {
  constexpr int deepest = 2;
  constexpr int most_entries = 100'000;
  fs::path first;
  std::error_code code, ignored;
  fs::recursive_directory_iterator at(path, fs::directory_options::skip_permission_denied, code);
  for (int n = 0; !code && at != fs::recursive_directory_iterator() && n < most_entries; at.increment(code), ++n) {
    if (!at->is_directory(ignored)) continue;
    bool const earlier = first.empty() || at->path() < first;
    if (earlier && holds_capture(at->path())) first = at->path();
    if (at.depth() >= deepest) at.disable_recursion_pending();
  }
  return first;
}

// Says what a folder without a capture is, and which path may have been meant.
[[noreturn]] void refuse_folder(fs::path const& path) {
  std::string what = "holds no capture that gart reads";
  if (fs::path const below = capture_below(path); !below.empty())
    throw io_error(path.string(), what, below.string() + " holds one: name it");
  if (holds_training(path))
    throw io_error(path.string(), "is the folder of a training, where a capture is wanted",
                   "name the capture; where a model is wanted, name " + (path / "model.ply").string());
  std::size_t const photos = file_names(path).size();
  if (photos) what = "holds " + counted(photos, "photograph") + " but no cameras";
  fs::path const up = ((path.has_filename() ? path : path.parent_path()) / "..").lexically_normal();
  if (holds_capture(up)) throw io_error(path.string(), what, "the capture is one folder up: name " + up.string());
  throw io_error(
      path.string(), what,
      photos
          ? "find the cameras with COLMAP: docs/getting_started.md says how"
          : "expected sparse/0 (COLMAP), transforms_train.json (Blender) or transforms.json (nerfstudio, instant-ngp)");
}

bool is_named_as_model(fs::path const& file) {
  auto const formats = splat_formats();
  std::string const name = lower(file.filename().string());
  return std::any_of(formats.begin(), formats.end(), [&](auto const* f) { return name.ends_with(f->extension); });
}

capture read_files(fs::path const& path, fs::path const& photos) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) throw io_error(path.string(), "there is no such file or folder", "check the path");
  if (!fs::is_directory(path, ignored)) {
    std::string const name = path.filename().string(), extension = path.extension().string();
    fs::path const folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
    if (name == "transforms_train.json") return read_blender(folder);
    if (extension == ".json") return read_transforms(path);
    bool const model = path.stem() == "cameras" || path.stem() == "images" || path.stem() == "points3D";
    if (model && (extension == ".bin" || extension == ".txt")) return read_colmap(folder, extension == ".txt", photos);
    if (is_named_as_model(path))
      throw io_error(path.string(), "is a model, where a capture is wanted",
                     "name a capture; the two may be swapped, for the model comes first");
    throw io_error(path.string(), "is not a capture that gart reads",
                   "name a folder, a transforms.json, or a COLMAP cameras.bin or cameras.txt");
  }
  fs::path const transforms = path / "transforms.json";
  std::vector<std::string> notes;
  if (auto const model = colmap_of(path, notes)) {
    capture c = read_colmap(model->folder, model->text, photos);
    c.notes.insert(c.notes.begin(), notes.begin(), notes.end());
    if (fs::exists(transforms, ignored)) {
      c.notes.push_back(
          "both a COLMAP model and transforms.json are there: COLMAP is used, for its points (to use the "
          "other, name " +
          transforms.string() + ")");
    }
    return c;
  }
  if (fs::exists(path / "transforms_train.json", ignored)) return read_blender(path);
  if (fs::exists(transforms, ignored)) return read_transforms(transforms);
  refuse_folder(path);
}

}  // namespace

capture read_capture(fs::path const& path, dataset_options const& options) {
  std::error_code ignored;
  if (!options.photos.empty() && !fs::is_directory(options.photos, ignored))
    throw io_error(options.photos.string(), "is no folder", "name the folder that the photos are in");
  capture c = read_files(path, options.photos);
  if (!options.photos.empty()) c.photos = options.photos;
  find_photos(c);
  if (options.masks)
    find_masks(c);
  else
    for (frame& f : c.frames) f.mask.clear();
  return c;
}

}  // namespace gart::io
