#pragma once
/// \file
/// A capture in host memory. It has views with cameras and 8-bit images, a split, and starting points where the files
/// have them.
///
/// load_dataset recognises, in a folder or by the file named: COLMAP, Blender, and nerfstudio / instant-ngp. COLMAP:
/// sparse/0 or its larger neighbour, sparse, the same below colmap, or the folder itself. Of its files .bin goes before
/// .txt; photos are in images/, images_N/ or input/. Blender: transforms_train.json and transforms_test.json, and
/// points3d.ply where there is one. nerfstudio: transforms.json. A folder that holds COLMAP and transforms.json is read
/// as COLMAP. Photos are found although names differ in case, slashes, extension or folders. Masks lie in a folder
/// masks beside them (docs/formats.md). Survey coordinates count from an origin among the cameras (io/origin.hpp).
/// Images are decoded in parallel and kept as 8 bits: width * height * channels bytes each. Frames without a photo or
/// with an invalid pose are left out with a note. So are points that are not finite, and points in a camera's centre.
/// Errors: io_error naming the file, the field and the remedy. Also unsupported, naming the model, for a camera that
/// gart does not trace. Also invalid_argument for an option out of its range.

#include <gart/comm/host_group.hpp>
#include <gart/core/names.hpp>
#include <gart/io/depth_file.hpp>
#include <gart/light/scene.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/image.hpp>

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace gart {

/// A photograph and its camera.
struct dataset_view {
  std::string name;   ///< unique in the dataset, fit for a file name: renders/NAME.png
  camera view;        ///< for the image as it is held (after dataset_options.downscale)
  image8 image;       ///< 3 channels, or 4 with straight alpha
  image8 mask;        ///< 1 channel, 0 = ignore, else the gradient's weight in parts of 255; empty: none
  image_float depth;  ///< distance along the ray, 0 = not measured; empty where none was asked for
};

/// Points with colours.
struct point_cloud {
  std::vector<float> position;  ///< [N][3]
  std::vector<u8> color;        ///< [N][3]
  /// Points.
  std::size_t size() const { return position.size() / 3; }
};

/// A capture.
struct dataset {
  std::string format;                     ///< "COLMAP", "Blender", "nerfstudio"
  std::string split;                      ///< how train and test were told apart, in words
  std::string resize_filter;              ///< "none", or "box (1/4)"
  std::vector<dataset_view> train, test;  ///< views to learn from, and views to score
  point_cloud points;                     ///< of the files; empty: they have none
  point_cloud matched;                    ///< by match_photographs (runtime/matched_points.hpp); empty: not asked for
  std::vector<std::string> notes;         ///< one line each: what was skipped, scaled or assumed
  vec3d origin{0.0};                      ///< what cameras and points are from, in the capture's coordinates
  float extent = 1;                       ///< 1.1 x the largest distance of a training camera from their mean
  bool alpha = false;                     ///< images carry alpha: composited over the background chosen
  std::size_t decoded = 0;  ///< photographs that this process has decoded: where ranks share them, its part
  /// Random starting points lie in this box; Blender's [-1.3, 1.3]^3, else around the cameras.
  vec3d bounds_min{-1.3}, bounds_max{1.3};  ///< corners
  light::scene mirrors = {};                ///< known to be in it, from the same origin: photographs show them

  /// Pixels of all training views.
  u64 training_pixels() const {
    u64 sum = 0;
    for (dataset_view const& v : train) sum += u64(v.view.width) * u64(v.view.height);
    return sum;
  }
};

/// Which depth maps to read of a capture, and what their values are. The map is the file that `depth_file_path` of a
/// transforms.json names. Else it is NAME.png or NAME.npy in a folder `depths` beside the photos' folder.
struct depth_map_options {
  bool load = false;  ///< whether to read those of the training views; then all must be there
  depth_kind kind =
      depth_kind::automatic;  ///< what they measure; automatic: what 'depth_kind' of the file says, else z
  /// Length of a step; 0: the file's 'depth_unit_scale_factor', else 0.001 for a PNG and 1 for a .npy.
  double unit = 0;
};

/// Which views are kept for testing. Each Nth by name lies between trained views. A sector of as many cameras lies on
/// both sides of the first by name, around all cameras' mean. No trained view sees from there.
enum class split_kind { nth, sector };
/// Their names.
constexpr auto names_of(split_kind) {
  using enum split_kind;
  return std::array<name_of<split_kind>, 2>{{{nth, "nth"}, {sector, "sector"}}};
}

/// What to read of a capture, and how.
struct dataset_options {
  int downscale = 1;   ///< integer factor, box filter; a partial last block of pixels is cropped, from cameras too
  int test_every = 8;  ///< 0: no test views; ignored where the files have their own split
  split_kind test_split = split_kind::nth;  ///< which of them; likewise
  std::filesystem::path photos = {};  ///< the folder that the photos' names are in; empty: where the capture has them
  std::optional<vec3d> origin = {};   ///< to hold the capture from, as a model's; none: its own (io/origin.hpp)
  bool masks = true;                  ///< those that the files name, else those in a folder masks beside the photos'
  bool load_images = true;       ///< false: cameras alone, for which photos may all be absent if the files state sizes
  depth_map_options depth = {};  ///< whether maps are read, and what they measure
  /// Called from the loading threads, one at a time.
  std::function<void(std::size_t done, std::size_t total)> progress = {};
  /// The ranks of one host that load the same capture. They share the decoding of images, and hold them once where the
  /// host can share memory. All call this together; an error of one rank is an error of all.
  host_group* host = nullptr;
};

/// Reads a capture from a folder, or by the file named.
dataset load_dataset(std::filesystem::path const& path, dataset_options const& options = {});

/// The camera of an image shrunk by dataset_options.downscale. A partial last block of pixels is cropped, so the scale
/// is exactly 1 / factor. Errors: invalid_argument, naming `where`, for an empty result. The same for a view of the
/// whole sphere that the factor does not divide.
camera downscaled(camera const& c, int factor, std::string const& where);

/// The cameras alone, from a dataset (all its views, test views first) or a camera JSON (io/camera_file.hpp).
/// EQUIRECTANGULAR has no fx to cy. Positions are in the coordinates of the capture, from no origin.
std::vector<named_camera> load_cameras(std::filesystem::path const& path);

}  // namespace gart
