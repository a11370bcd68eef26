#include "codec.hpp"
#include "webp.hpp"

#include <gart/core/error.hpp>
#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/scene/block_mean.hpp>

#include <algorithm>
#include <string_view>

namespace gart {
namespace {

[[noreturn]] void refuse_kind(std::string const& where) {
  throw io_error(where, "is neither PNG, JPEG nor WebP", "convert it to one of them");
}

}  // namespace

image8 read_image(std::filesystem::path const& path) { return io::decode_image(read_file(path), path.string()); }

image8 io::decode_image(std::vector<u8> const& bytes, std::string const& where) {
  if (is_png(bytes)) return decode_png(bytes, where);
  if (is_jpeg(bytes)) return decode_jpeg(bytes, where);
  if (is_webp(bytes)) return decode_webp_photo(bytes, where);
  refuse_kind(where);
}

io::image_size io::read_image_size(std::filesystem::path const& path) {
  std::vector<u8> const bytes = read_file(path);
  if (is_png(bytes)) return png_size(bytes, path.string());
  if (is_jpeg(bytes)) return jpeg_size(bytes, path.string());
  if (is_webp(bytes)) return webp_size(bytes, path.string());
  refuse_kind(path.string());
}

void write_png(std::filesystem::path const& path, image8 const& image) { write_file(path, encode_png(image)); }

image8 box_downscale(image8 const& image, int factor) {
  if (factor < 1) throw invalid_argument("box_downscale: factor must be at least 1");
  if (factor == 1) return image;
  int const width = image.width / factor, height = image.height / factor, channels = image.channels;
  if (width < 1 || height < 1) {
    throw invalid_argument("box_downscale: factor " + std::to_string(factor) + " leaves nothing of an image of " +
                           std::to_string(image.width) + " x " + std::to_string(image.height));
  }
  image8 result(width, height, channels);
  pixel_blocks const blocks{static_cast<std::size_t>(image.width), static_cast<std::size_t>(factor),
                            static_cast<std::size_t>(width)};
  for (std::size_t i = 0; i < blocks.across * static_cast<std::size_t>(height); ++i)
    block_mean(image.data.data(), channels, nullptr, blocks, i, &result.data[i * static_cast<std::size_t>(channels)]);
  return result;
}

image_float to_float(image8 const& image) {
  image_float result(image.width, image.height, image.channels);
  std::transform(image.data.begin(), image.data.end(), result.data.begin(),
                 [](u8 v) { return static_cast<float>(v) / 255.0f; });
  return result;
}

image8 to_8bit(image_float const& image) {
  image8 result(image.width, image.height, image.channels);
  std::transform(image.data.begin(), image.data.end(), result.data.begin(), [](float v) {
    return static_cast<u8>(v > 0 ? std::min(v, 1.0f) * 255.0f + 0.5f : 0.0f);  // NaN becomes 0
  });
  return result;
}

}  // namespace gart
