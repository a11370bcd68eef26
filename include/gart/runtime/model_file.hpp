#pragma once
/// \file
/// A model and the settings that it was trained with, in any format of io/splat_file.hpp. Settings that differ from the
/// defaults stand in a splat PLY's header as "comment gart KEY VALUE". Keys: alpha_min, transmittance_min (older:
/// t_min), near, max_hits, antialias, kernel_degree, origin. A model with the defaults is byte for byte an ordinary
/// file. Models of other programs are read with the defaults.
///
/// Errors: load_model throws io_error for a file that is no splat file, or whose header has a wrong value. It names the
/// file, the key and the remedy. save_model: as write_splats (io/splat_file.hpp).

#include <gart/io/origin.hpp>
#include <gart/io/scene_file.hpp>
#include <gart/render/options.hpp>
#include <gart/scene/gaussians.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace gart {

/// A model, and the settings to render it with.
struct model_file {
  gaussian_model model;                 ///< the Gaussians, or a rank's rows of them
  render_options render;                ///< the background is in no file
  int kernel_degree = 2;                ///< of the response (math/response.hpp)
  vec3d origin{0.0};                    ///< of its coordinates (io/origin.hpp)
  u64 total = 0;                        ///< Gaussians in the file that was read
  std::vector<std::string> notes = {};  ///< a line each: which of them were left out (io/splat_file.hpp)
};

/// Errors: io_error naming the file and its fault.
model_file load_model(std::filesystem::path const& path);
/// The same with this rank's rows alone. Of a binary splat PLY no other rows are read.
model_file load_model(std::filesystem::path const& path, row_owners const& owners);
/// Those of a scene, each in its place, as one model: with the origin and the rendering of the first. Errors:
/// unsupported where their kernel degrees differ. Without files, a model without Gaussians.
model_file load_models(std::vector<placed_splats> const& splats);
/// Written to a temporary name, then renamed. Errors: io_error.
void save_model(std::filesystem::path const& path, model_file const& file);

/// The header's settings: those that differ from the default render options and kernel degree 2.
splat_traits traits_of(render_options const& render, int kernel_degree);

inline constexpr u32 max_hits_most = 1'000'000'000;  ///< largest cap of hits that a file can have

}  // namespace gart
