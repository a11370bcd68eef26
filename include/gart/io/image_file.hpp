#pragma once
/// \file
/// Images in PNG (libpng) and JPEG (libjpeg-turbo), 8 bits a channel. WebP is read where gart is built with libwebp.
/// 16-bit PNG is reduced to 8. The kind is told by the file's first bytes, not by its name. Pixels stay as they are
/// stored, whatever an EXIF orientation says. Errors: io_error with the file and the decoder's words.

#include <gart/scene/image.hpp>

#include <filesystem>
#include <vector>

namespace gart {

image8 read_image(std::filesystem::path const& path);                    ///< 1, 3 or 4 channels, as the file has
void write_png(std::filesystem::path const& path, image8 const& image);  ///< to a temporary name, then renamed
std::vector<u8> encode_png(image8 const& image);                         ///< 1, 3 or 4 channels
std::vector<u8> encode_jpeg(image8 const& image, int quality = 90);      ///< 1 or 3: JPEG has no alpha

/// Mean over blocks of factor x factor pixels; a partial last block is dropped. Alpha weights the colours.
image8 box_downscale(image8 const& image, int factor);

/// From 0..255 to [0, 1].
image_float to_float(image8 const& image);
image8 to_8bit(image_float const& image);  ///< clamped, rounded to nearest

}  // namespace gart
