#pragma once
// SPZ inside other files.

#include <gart/io/splat_file.hpp>

#include <string>
#include <vector>

namespace gart::io {

// Reads a whole SPZ file; `name` in errors. traits and notes may be null.
gaussian_model read_spz(std::vector<u8> bytes, std::string const& name, splat_traits* traits,
                        std::vector<std::string>* notes);

// A file of version 2, which glTF's extension names; `path` in errors. The width of antialias and the origin are lost.
std::vector<u8> spz_2(std::filesystem::path const& path, gaussian_model const& model, splat_traits const& traits,
                      splat_packing const& packing);

}  // namespace gart::io
