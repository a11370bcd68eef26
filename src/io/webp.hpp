#pragma once
// WebP: lossless textures, four bytes a pixel there and back, whatever the fourth is; and photographs.

#include "codec.hpp"

#include <gart/core/types.hpp>

#include <string>
#include <vector>

namespace gart::io {

struct texture {
  int width = 0, height = 0;
  std::vector<u8> rgba;

  texture() = default;
  texture(int w, int h) : width(w), height(h), rgba(pixels() * 4, 0) {}
  std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
};

// io_error naming the package, where gart was built without libwebp; also for more than `most` pixels, or no WebP.
std::vector<u8> encode_webp(texture const& image, std::string const& file);
texture decode_webp(std::vector<u8> const& bytes, std::size_t most, std::string const& file, std::string const& entry);

bool is_webp(std::vector<u8> const& bytes);
// 3 channels, or 4 with straight alpha; `where` names the file in errors.
image8 decode_webp_photo(std::vector<u8> const& bytes, std::string const& where);
image_size webp_size(std::vector<u8> const& bytes, std::string const& where);

}  // namespace gart::io
