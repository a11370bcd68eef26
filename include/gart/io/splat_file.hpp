#pragma once
/// \file
/// Files of Gaussians in any format that gart knows: one table has them. A file is known by its first bytes when it is
/// read, whatever its name, and by the ending of its name when it is written.
///
/// Errors: io_error naming the file and the formats there are, where it is in none of them; else as the format's own
/// reader and writer (io/ply.hpp).

#include <gart/core/span.hpp>
#include <gart/scene/gaussians.hpp>

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

namespace gart {

/// What a model was trained with, key -> value, where a format has room for it.
using splat_traits = std::map<std::string, std::string>;

/// A format of files of Gaussians.
struct splat_format {
  char const* name;                                                             ///< as people call it
  char const* extension;                                                        ///< with its dot, in lower case
  bool (*begins)(std::string_view first);                                       ///< whether its files begin so
  gaussian_model (*read)(std::filesystem::path const& path, splat_traits* to);  ///< traits only where `to` is not null
  void (*write)(std::filesystem::path const& path, gaussian_model const& model,
                splat_traits const& traits);  ///< null for a format that is only read
};

/// The formats there are. `begins` is given the first 16 bytes, or all of a shorter file.
span<splat_format const* const> splat_formats();

/// Reads a file of Gaussians; its traits into `traits`, where that is not null.
gaussian_model read_splats(std::filesystem::path const& path, splat_traits* traits = nullptr);
/// Writes a file of Gaussians, to a temporary name, then renamed.
void write_splats(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits = {});

}  // namespace gart
