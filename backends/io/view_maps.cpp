#include "view_maps.hpp"

#include <gart/camera/models.hpp>
#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>

#include <algorithm>
#include <string>
#include <system_error>

namespace gart::io {

namespace fs = std::filesystem;

namespace {

// The map of a photo in the folder `depths` beside its `images`; the PNG where there is neither.
fs::path depth_beside(fs::path const& photo) {
  fs::path found, folder = photo.parent_path(), below;
  for (; folder.has_filename(); folder = folder.parent_path()) {
    if (folder.filename().string().starts_with("images")) break;
    below = folder.filename() / below;
  }
  fs::path const map = (folder.has_filename() ? folder.parent_path() : photo.parent_path()) / "depths" /
                       (folder.has_filename() ? below : fs::path()) / photo.stem();
  std::error_code ignored;
  for (char const* extension : {".png", ".npy"}) {
    fs::path with = map;
    with += extension;
    if (fs::is_regular_file(with, ignored)) return with;
    if (found.empty()) found = with;
  }
  return found;
}

}  // namespace

image8 read_mask(fs::path const& path, image_size size, int factor) {
  image8 const source = read_image(path);
  if (source.width != size.width || source.height != size.height) {
    throw io_error(path.string(),
                   "the mask is " + std::to_string(source.width) + " x " + std::to_string(source.height) +
                       " pixels, its photo " + std::to_string(size.width) + " x " + std::to_string(size.height),
                   "make both the same size");
  }
  image8 mask(size.width / factor, size.height / factor, 1, 255);
  int const colors = std::min(source.channels, 3);
  for (int y = 0; y < mask.height * factor; ++y) {
    for (int x = 0; x < mask.width * factor; ++x) {
      bool used = false;
      for (int c = 0; c < colors; ++c) used = used || source.at(x, y, c) != 0;
      if (!used) mask.at(x / factor, y / factor, 0) = 0;
    }
  }
  return mask;
}

image_float read_distances(frame const& f, camera const& view, image_size size, dataset_options const& options) {
  fs::path const path = f.depth.empty() ? depth_beside(f.photo) : f.depth;
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) {
    throw io_error(path.string(), "the depth map of " + f.name + " is not there",
                   "put NAME.png or NAME.npy into a folder depths beside images, or name it by 'depth_file_path'");
  }
  depth_map_options const& asked = options.depth;
  image_float const map = read_depth(path, asked.unit != 0 ? asked.unit : f.depth_unit);
  if (map.width != size.width || map.height != size.height) {
    throw io_error(path.string(),
                   "the depth map is " + std::to_string(map.width) + " x " + std::to_string(map.height) +
                       " pixels, its photo " + std::to_string(size.width) + " x " + std::to_string(size.height),
                   "make both the same size");
  }
  depth_kind const kind = asked.kind != depth_kind::automatic ? asked.kind : f.depth_is;
  image_float out(view.width, view.height, 1);
  visit_camera(view, [&](auto const& model) {
    for (int y = 0; y < out.height; ++y) {
      for (int x = 0; x < out.width; ++x) {
        int const half = options.downscale / 2;
        float const depth = map.at(x * options.downscale + half, y * options.downscale + half, 0);
        float cosine = 1;
        if (kind != depth_kind::distance) {
          vec3 const d = model.ray(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f).direction;
          vec3 const axis = view.rotation[2];
          cosine = d.x * axis.x + d.y * axis.y + d.z * axis.z;
        }
        if (depth > 0 && !(cosine > 0))
          throw io_error(path.string(), "is said to hold z, which rays beyond 90 degrees have none of",
                         "store distances, and say depth_kind = distance");
        out.at(x, y, 0) = depth > 0 ? depth / cosine : 0;
      }
    }
  });
  return out;
}

}  // namespace gart::io
