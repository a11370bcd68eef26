#include "webp.hpp"

#include "compression.hpp"

#if defined(GART_WITH_WEBP)
#include <webp/decode.h>
#include <webp/encode.h>
#endif

#include <memory>

namespace gart::io {

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

#else

std::vector<u8> encode_webp(texture const&, std::string const& file) {
  refuse_without(file, "SOG", "libwebp", "libwebp-dev");
}
texture decode_webp(std::vector<u8> const&, std::size_t, std::string const& file, std::string const&) {
  refuse_without(file, "SOG", "libwebp", "libwebp-dev");
}

#endif

}  // namespace gart::io
