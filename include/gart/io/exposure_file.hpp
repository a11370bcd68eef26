#pragma once
/// \file
/// Exposures of training views and falloffs of lenses as JSON, for `gart render`, `gart eval` and people:
///   {"views": [{"name": "00002", "position": [x, y, z], "direction": [x, y, z], "matrix": [12 numbers]}, ...],
///    "lenses": [{"focal": [x, y], "center": [x, y], "falloff": [9 numbers]}, ...]}
/// `position` and `direction`: of the camera and its axis, in the capture's coordinates (io/origin.hpp). `matrix`: a
/// row of M, then its offset, three times (exposure/exposure.hpp). `focal` and `center`: focal lengths and principal
/// point over the images' width and height, which tell lenses apart. `falloff`: k0, k1, k2 of each channel
/// (exposure/vignetting.hpp). Either list may be missing or empty, not both. Written whole or not at all. Errors:
/// io_error naming the file, the view or lens and the field.

#include <gart/exposure/exposure_field.hpp>

#include <filesystem>

namespace gart {

/// Writes all views of a field, which is from that origin.
void write_exposures(std::filesystem::path const& path, exposure_field const& field, vec3d const& origin = vec3d(0.0));
/// Reads what write_exposures wrote, from that origin.
exposure_field read_exposures(std::filesystem::path const& path, vec3d const& origin = vec3d(0.0));

}  // namespace gart
