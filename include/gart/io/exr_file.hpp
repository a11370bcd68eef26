#pragma once
/// \file
/// Images of floats as OpenEXR files (https://openexr.com): one part of scan lines, 32-bit floats, packed without loss
/// (ZIP, 16 lines at a time). Written only; needs zlib, no other library.

#include <gart/scene/image.hpp>

#include <filesystem>
#include <string_view>

namespace gart {

/// channels: a letter for each channel of the image, in its order, as "RGB", "Z" or "A", no two alike. Colours are
/// written as they are, without a change of their transfer curve. Errors: invalid_argument for another number of
/// letters or an empty image, io_error for a file that cannot be written.
void write_exr(std::filesystem::path const& path, image_float const& image, std::string_view channels);

}  // namespace gart
