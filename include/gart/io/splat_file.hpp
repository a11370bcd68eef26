#pragma once
/// \file
/// Files of Gaussians in any format that gart knows: one table has them. A reader knows a file by its first bytes, a
/// writer by the ending of its name. The page docs/formats.md describes each format and its cost.
///
/// Every model is in the axes of a splat PLY. Other axes are turned as files are read and written (SPZ: y up, z back;
/// GLB: y up, x left). Colours that depend on direction turn too.
///
/// Errors: io_error naming the file and the supported formats, where it has none of them. Also io_error naming a
/// property that changes the image and that the format cannot hold. Also io_error naming the package to install, where
/// gart was built without it. Else as the format's reader and writer (io/ply.hpp). Also invalid_argument for a model
/// whose arrays disagree in size, and for a packing out of its range.

#include <gart/comm/row_owners.hpp>
#include <gart/core/span.hpp>
#include <gart/scene/gaussians.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace gart {

/// The settings that a model was trained with, key -> value, where a format has room for them.
using splat_traits = std::map<std::string, std::string>;

/// How the formats that pack their numbers are written.
struct splat_packing {
  int sh1_bits = 6;    ///< SPZ: of a coefficient of degree 1, 1 to 8
  int sh_bits = 6;     ///< SPZ: of a coefficient of degree 2 or 3, 1 to 8
  int palette = 0;     ///< SOG: rows of coefficients that all Gaussians share, to 65,536; 0: by their number
  bool spz = false;    ///< GLB: packed as SPZ 2, which not all readers of GLB know
  bool world = false;  ///< PLY, GLB: in the capture's own coordinates, in double (io/origin.hpp)
};

/// The properties that a format can hold, besides means, scales, rotations, opacities and a colour.
struct format_capabilities {
  int sh_degree = 3;       ///< of its spherical harmonics
  bool strays = true;      ///< means far beyond the others (256 times the reach of 99 of 100), without loss to these
  bool traits = false;     ///< keys and values
  bool kernel = false;     ///< another kernel than the Gaussian, said by the trait kernel_degree
  bool antialias = false;  ///< a mark for the trait antialias, without its width
  bool origin = false;     ///< the trait origin (io/origin.hpp)
  bool world = false;      ///< coordinates in double, for splat_packing.world
  bool spz = false;        ///< SPZ inside, for splat_packing.spz
  bool features = false;   ///< of each Gaussian (scene/features.hpp)
};

/// A format of files of Gaussians.
struct splat_format {
  char const* name;                        ///< as people call it
  char const* extension;                   ///< with its dots, in lower case
  format_capabilities capabilities;        ///< `write` is given no more than that
  bool (*begins)(std::string_view first);  ///< whether its files begin so; null: known by the ending alone
  gaussian_model (*read)(std::filesystem::path const& path, splat_traits* to,
                         std::vector<std::string>* notes);  ///< either only where it is not null
  void (*write)(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits,
                splat_packing const& packing);  ///< null for a format that is only read
};

/// The formats there are. `begins` is given the first 4,096 bytes, or all of a shorter file. Where an ending is the
/// end of another, the longer one is first.
span<splat_format const* const> splat_formats();

/// Reads a file of Gaussians; its traits into `traits`, where that is not null. A Gaussian with a number that is not
/// finite, or a rotation of zeros, is left out. `notes`, if not null, says how many, and the fault of the first. A file
/// of no other is refused. An opacity with an infinite logit becomes 1 or 0, a scale with the logarithm -inf becomes 0.
/// The model has finite numbers for these. A quaternion too short or too long to be drawn gets the length 1. Of SOG
/// `path` may be a folder, or the meta.json in it.
gaussian_model read_splats(std::filesystem::path const& path, splat_traits* traits = nullptr,
                           std::vector<std::string>* notes = nullptr);
/// A rank's rows of a whole model.
gaussian_model rows_of(gaussian_model const& all, row_owners const& owners);
/// Reads this rank's Gaussians of the file's `total`. Of a binary splat PLY no others are read. Several ranks therefore
/// refuse a bad Gaussian in place of leaving it out.
gaussian_model read_splat_rows(std::filesystem::path const& path, row_owners const& owners, u64& total,
                               splat_traits* traits = nullptr, std::vector<std::string>* notes = nullptr);
/// Writes a file of Gaussians, to a temporary name, then renamed.
void write_splats(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits = {},
                  splat_packing const& packing = {});

/// The properties of this model that the named format cannot hold and write_splats leaves out, a line each.
std::vector<std::string> left_out(std::filesystem::path const& path, gaussian_model const& model,
                                  splat_traits const& traits, splat_packing const& packing = {});

}  // namespace gart
