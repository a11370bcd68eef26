#pragma once
/// \file
/// Images of floats as OpenEXR files (https://openexr.com), as programs of compositing read them: one part of scan
/// lines. Written as 32-bit floats, packed without loss (ZIP, 16 lines at a time). Read of 16 or 32 bits, unpacked or
/// packed by RLE, ZIPS or ZIP. Needs zlib, no other library.

#include <gart/scene/image.hpp>

#include <filesystem>
#include <string_view>

namespace gart {

/// channels: a letter for each channel of the image, in its order, as "RGB", "Z" or "A", no two alike. Colours are
/// written as they are, without a change of their transfer curve. Errors: invalid_argument for another number of
/// letters or an empty image, io_error for a file that cannot be written.
void write_exr(std::filesystem::path const& path, image_float const& image, std::string_view channels);

/// These channels of a file, in this order. A file that has Y alone gives Y for R, G and B. Numbers stay as they are,
/// NaN too. Errors: io_error naming the file and the field, for a damaged file or one without a channel. Also for a
/// tiled or deep one, one of several parts, or of another compression.
image_float read_exr(std::filesystem::path const& path, std::string_view channels = "RGB");

/// Linear RGB of all directions as EXR or Radiance HDR (RGBE), told by the first bytes. Values that are not finite or
/// below 0 become 0; values above 65504 become that. Errors: io_error naming the file and the remedy.
image_float read_radiance(std::filesystem::path const& path);

}  // namespace gart
