#pragma once
// SPZ as other files have it within them.

#include <gart/io/splat_file.hpp>

#include <string>
#include <vector>

namespace gart::io {

// All of an SPZ file, `name` in errors; traits and notes where they are not null.
gaussian_model read_spz(std::vector<u8> bytes, std::string const& name, splat_traits* traits,
                        std::vector<std::string>* notes);

}  // namespace gart::io
