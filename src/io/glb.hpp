#pragma once
// GLB with KHR_gaussian_splatting: a glTF mesh of points whose attributes are Gaussians', unpacked, or packed as SPZ
// (KHR_gaussian_splatting_compression_spz_2). Axes: x left, y up, z forward. The parts that the reader (glb.cpp) and
// the writer (glb_writer.cpp) share.
// https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting

#include <gart/io/splat_file.hpp>
#include <gart/math/glm.hpp>

#include <string>

namespace gart::io::glb {

inline constexpr char const *extension = "KHR_gaussian_splatting",
                            *spz_extension = "KHR_gaussian_splatting_compression_spz_2";
inline constexpr char const *kernel = "ellipse", *color_space = "srgb_rec709_display";
inline constexpr int up_axis = 2;  // half a turn about z is from a splat file's axes to glTF's

inline std::string attribute(std::string const& name) { return std::string(extension) + ":" + name; }

// The coefficient k of 16 in the extension's words.
inline std::string coefficient_name(int k) {
  int degree = 0;
  while (k >= (degree + 1) * (degree + 1)) ++degree;
  return attribute("SH_DEGREE_" + std::to_string(degree) + "_COEF_" + std::to_string(k - degree * degree));
}

// The half turn of a place.
inline vec3d turned(vec3d const& p) { return {-p.x, -p.y, p.z}; }

void write(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits,
           splat_packing const& packing);

}  // namespace gart::io::glb
