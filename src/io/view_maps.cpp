#include "view_maps.hpp"

#include "file_names.hpp"

#include <gart/camera/models.hpp>
#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <system_error>

namespace gart::io {

namespace fs = std::filesystem;

namespace {

// A photo's map in the folder `depths` beside that of the photos. The PNG's path if there is none.
fs::path depth_beside(fs::path const& photo) {
  auto const [folder, below] = beside_photos(photo, "depths");
  file_names maps(folder, {".png", ".npy"});
  for (char const* extension : {".png", ".npy"})
    if (fs::path const map = maps.find(fs::path(below).replace_extension(extension).generic_string()).file;
        !map.empty())
      return map;
  return folder / fs::path(below).replace_extension(".png");
}

// Which way the camera looks while a pixel is read.
vec3 axis_of(camera const& view, float u, float v) {
  if (view.shutter == shutter_kind::global) return view.rotation[2];
  return at_time(view, shutter_lines_of(view).time_at<double>(u, v)).rotation[2];
}

}  // namespace

image8 read_mask(fs::path const& path, image_size size, int factor) {
  image8 const source = read_image(path);
  // A mask of the full size serves smaller copies of its photo.
  double const sx = static_cast<double>(source.width) / size.width,
               sy = static_cast<double>(source.height) / size.height;
  if (std::abs(sx / sy - 1) > 0.01 && std::abs(source.height / sx - size.height) > 1) {
    throw io_error(path.string(),
                   "the mask is " + std::to_string(source.width) + " x " + std::to_string(source.height) +
                       " pixels, its photo " + std::to_string(size.width) + " x " + std::to_string(size.height),
                   "make both of the same shape");
  }
  image8 mask(size.width / factor, size.height / factor, 1, 255);
  int const colors = std::min(source.channels, 3);
  auto const nearest = [](int at, double scale, int most) {
    return std::min(most - 1, static_cast<int>((at + 0.5) * scale));
  };
  for (int y = 0; y < mask.height * factor; ++y) {
    for (int x = 0; x < mask.width * factor; ++x) {
      bool used = false;
      for (int c = 0; c < colors; ++c)
        used = used || source.at(nearest(x, sx, source.width), nearest(y, sy, source.height), c) != 0;
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
          vec3 const axis = axis_of(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
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
