#include "webp.hpp"

#include "compression.hpp"

#if defined(GART_WITH_WEBP)
#include <webp/decode.h>
#include <webp/encode.h>
#endif

#include <cstring>

namespace gart::io {

bool is_webp(std::vector<u8> const& bytes) {
  return bytes.size() >= 12 && std::memcmp(bytes.data(), "RIFF", 4) == 0 && std::memcmp(&bytes[8], "WEBP", 4) == 0;
}

#if defined(GART_WITH_WEBP)

std::vector<u8> encode_webp(texture const& image, std::string const& file) {
  auto const require = [&](bool good) {
    if (!good) throw io_error(file, "libwebp could not encode a texture", "free some memory, or keep fewer Gaussians");
  };
  WebPConfig config;
  WebPPicture picture;
  require(WebPConfigInit(&config) && WebPConfigLosslessPreset(&config, 5) && WebPPictureInit(&picture));
  config.exact = 1;  // the colour of a pixel is kept where its fourth byte is 0
  config.thread_level = 1;
  picture.use_argb = 1, picture.width = image.width, picture.height = image.height;
  WebPMemoryWriter writer;
  WebPMemoryWriterInit(&writer);
  picture.writer = WebPMemoryWrite, picture.custom_ptr = &writer;
  struct cleanup {
    WebPPicture& picture;
    WebPMemoryWriter& writer;
    ~cleanup() { WebPPictureFree(&picture), WebPMemoryWriterClear(&writer); }
  } const end{picture, writer};
  require(WebPPictureImportRGBA(&picture, image.rgba.data(), 4 * image.width));
  require(WebPEncode(&config, &picture));
  return {writer.mem, writer.mem + writer.size};
}

texture decode_webp(std::vector<u8> const& bytes, std::size_t most, std::string const& file, std::string const& entry) {
  auto const refuse = [&](std::string const& what) {
    throw io_error(file, "the entry " + entry + " " + what, "the file is damaged: copy or export it again");
  };
  texture image;
  if (!WebPGetInfo(bytes.data(), bytes.size(), &image.width, &image.height)) refuse("is no WebP image");
  if (image.pixels() > most) refuse("is larger than belongs there");
  image.rgba.resize(4 * image.pixels());
  if (!WebPDecodeRGBAInto(bytes.data(), bytes.size(), image.rgba.data(), image.rgba.size(), 4 * image.width))
    refuse("cannot be decoded");
  return image;
}

namespace {

// The most pixels, even of one colour: 16 million, or a thousand a byte.
constexpr u64 most_pixels = u64{1} << 24, pixels_a_byte = 1024;

WebPBitstreamFeatures features_of(std::vector<u8> const& bytes, std::string const& where) {
  WebPBitstreamFeatures f;
  if (WebPGetFeatures(bytes.data(), bytes.size(), &f) != VP8_STATUS_OK)
    throw io_error(where, "is not a readable WebP", "replace the file");
  if (f.has_animation) throw io_error(where, "is a WebP of several images", "save one of them alone");
  u64 const pixels = static_cast<u64>(f.width) * static_cast<u64>(f.height);
  if (pixels > most_pixels && pixels > pixels_a_byte * bytes.size())
    throw io_error(where, "the size in its header is larger than its data can hold", "replace the file");
  return f;
}

}  // namespace

image_size webp_size(std::vector<u8> const& bytes, std::string const& where) {
  WebPBitstreamFeatures const f = features_of(bytes, where);
  return {f.width, f.height};
}

image8 decode_webp_photo(std::vector<u8> const& bytes, std::string const& where) {
  WebPBitstreamFeatures const f = features_of(bytes, where);
  image8 image(f.width, f.height, f.has_alpha ? 4 : 3);
  auto const decode = f.has_alpha ? WebPDecodeRGBAInto : WebPDecodeRGBInto;
  if (!decode(bytes.data(), bytes.size(), image.data.data(), image.data.size(), f.width * image.channels))
    throw io_error(where, "is not a readable WebP", "replace the file");
  return image;
}

#else

image_size webp_size(std::vector<u8> const&, std::string const& where) {
  refuse_without(where, "a WebP photograph", "libwebp", "libwebp-dev");
}
image8 decode_webp_photo(std::vector<u8> const&, std::string const& where) {
  refuse_without(where, "a WebP photograph", "libwebp", "libwebp-dev");
}

std::vector<u8> encode_webp(texture const&, std::string const& file) {
  refuse_without(file, "SOG", "libwebp", "libwebp-dev");
}
texture decode_webp(std::vector<u8> const&, std::size_t, std::string const& file, std::string const&) {
  refuse_without(file, "SOG", "libwebp", "libwebp-dev");
}

#endif

}  // namespace gart::io
