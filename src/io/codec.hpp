#pragma once
// The two image codecs behind image_file.hpp: a whole file in memory to and from pixels. `where` names the file in
// errors.

#include <gart/core/types.hpp>
#include <gart/scene/image.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace gart::io {

struct image_size {
  int width = 0, height = 0;
};

bool is_png(std::vector<u8> const& bytes);
bool is_jpeg(std::vector<u8> const& bytes);

// PNG, JPEG or WebP.
image8 decode_image(std::vector<u8> const& bytes, std::string const& where);
image8 decode_png(std::vector<u8> const& bytes, std::string const& where);
// One channel of 16 bits, for depth maps; any other kind is refused.
basic_image<u16> decode_png16(std::vector<u8> const& bytes, std::string const& where);
std::vector<u8> encode_png16(basic_image<u16> const& image);
image8 decode_jpeg(std::vector<u8> const& bytes, std::string const& where);

image_size png_size(std::vector<u8> const& bytes, std::string const& where);
image_size jpeg_size(std::vector<u8> const& bytes, std::string const& where);

// The size of an image file, its pixels not decoded.
image_size read_image_size(std::filesystem::path const& path);

}  // namespace gart::io
