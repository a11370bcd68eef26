#pragma once
/// \file
/// Cameras as JSON, as load_cameras (io/dataset.hpp) reads them and the program renders them:
///   [{"name", "width", "height", "fx", "fy", "cx", "cy", "c2w": 4 rows of 4}, ...]
/// in pixels, c2w camera to world in OpenCV axes; with "camera_model": "OPENCV" and "k1", "k2", "p1", "p2" where the
/// lens is distorted. Written whole or not at all, with every digit. Errors: io_error.

#include <gart/scene/camera.hpp>

#include <filesystem>
#include <vector>

namespace gart {

/// Writes all of them, in order.
void write_cameras(std::filesystem::path const& path, std::vector<named_camera> const& cameras);

}  // namespace gart
