#pragma once
/// \file
/// Cameras in files: the names of models, and the camera JSON of load_cameras (io/dataset.hpp). It is [{"name",
/// "width", "height", "fx", "fy", "cx", "cy", "c2w": 4 rows of 4}, ...] in pixels. The pose c2w maps camera to world,
/// in OpenCV axes. Cameras other than pinholes have "camera_model", by COLMAP's name, and the parameters of the lens. A
/// rolling shutter has its direction in "shutter_type", as "ROLLING_TOP_TO_BOTTOM". Then c2w is the pose of the first
/// line read, and "c2w_end" that of the last. An "origin" of three numbers is added to positions as they are read.
/// Written whole or not at all, with every digit. Errors: io_error; unsupported for a lens with terms that no one model
/// has.

#include <gart/scene/camera.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace gart {

/// What files call a camera's model, and its parameters by their names there.
struct camera_fields {
  std::string model;                                  ///< COLMAP's name
  std::vector<std::pair<std::string, float>> values;  ///< as "fx"; none of EQUIRECTANGULAR
};

/// Of a camera.
camera_fields fields_of(camera const& view);

/// "GLOBAL", "ROLLING_TOP_TO_BOTTOM" and so on, the names in files.
std::string shutter_type_of(camera const& view);

/// The same pose and height through another camera: COLMAP's name of its model, and any parameters. As "FISHEYE",
/// "OPENCV_FISHEYE,k1=0.02,fx=90", "EQUIRECTANGULAR". Without focal lengths `angle` counts: the degrees across the
/// image's shorter side. Its default is 180 for models that can see that, else 60. Parallel rays take `extent`, the
/// world units across that side. The sphere is twice as wide as high. Errors: unsupported; invalid_argument for text
/// that names no camera.
camera seen_through(camera const& view, std::string const& model);

/// A camera as one object of such a list, on one line.
std::string camera_json(named_camera const& camera);
/// And back; it may have no name. `where` is what errors say it is of.
named_camera parse_camera_json(std::string_view object, std::string const& where);

/// Writes all of them, in order.
void write_cameras(std::filesystem::path const& path, std::vector<named_camera> const& cameras);

}  // namespace gart
