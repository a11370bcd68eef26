#pragma once
/// \file
/// Depth maps in files: PNG with one channel of 16 bits. A step is `unit` in the scene's lengths; 0 means not measured.
/// Or .npy (NumPy, version 1 to 3) of little-endian float32 in C order, [H][W] or [H][W][1]. The kind is told by the
/// first bytes. A file does not say whether its map measures z or distance (io/dataset.hpp). Errors: io_error naming
/// the file and the fault.

#include <gart/core/names.hpp>
#include <gart/scene/image.hpp>

#include <filesystem>

namespace gart {

/// The quantity of a depth map: along the camera's axis, or along the ray. `automatic`: the quantity that the capture
/// names, else z.
enum class depth_kind { automatic, z, distance };
/// Their names.
constexpr auto names_of(depth_kind) {
  using enum depth_kind;
  return std::array<name_of<depth_kind>, 3>{{{automatic, "auto"}, {z, "z"}, {distance, "distance"}}};
}

/// Reads a map in the scene's lengths; 0: not measured. unit: length of a step, or of 1 in a .npy. Its 0 means 0.001
/// for a PNG, 1 for a .npy. Errors: io_error also for a value that is not finite or negative.
image_float read_depth(std::filesystem::path const& path, double unit = 0);
/// Writes a map of one channel as 16-bit PNG: value / unit, rounded, at most 65535. Values that are not positive and
/// finite become 0.
void write_depth_png(std::filesystem::path const& path, image_float const& map, double unit);
/// An image of any number of channels as .npy, float32, [H][W][channels], or [H][W] for one.
void write_npy(std::filesystem::path const& path, image_float const& image);

}  // namespace gart
