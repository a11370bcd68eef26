// JPEG through libjpeg-turbo's TurboJPEG interface.

#include "codec.hpp"

#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>

#include <turbojpeg.h>

#include <memory>
#include <type_traits>

namespace gart {
namespace io {
namespace {

struct destroy_handle {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using tj_handle = std::unique_ptr<std::remove_pointer_t<tjhandle>, destroy_handle>;

struct jpeg_header {
  image_size size;
  int colorspace = 0;
};

[[noreturn]] void refuse(std::string const& where, std::string const& what) {
  throw io_error(where, "is not a readable JPEG: " + what, "replace the file");
}

jpeg_header read_header(void* decoder, std::vector<u8> const& bytes, std::string const& where) {
  jpeg_header header;
  int subsampling = 0;
  if (tjDecompressHeader3(decoder, bytes.data(), bytes.size(), &header.size.width, &header.size.height, &subsampling,
                          &header.colorspace) != 0) {
    refuse(where, tjGetErrorStr2(decoder));
  }
  if (header.size.width < 1 || header.size.height < 1) refuse(where, "its size is out of range");
  return header;
}

}  // namespace

bool is_jpeg(std::vector<u8> const& bytes) {
  return bytes.size() >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff;
}

image_size jpeg_size(std::vector<u8> const& bytes, std::string const& where) {
  tj_handle const decoder(tjInitDecompress());
  if (!decoder) refuse(where, tjGetErrorStr2(nullptr));
  return read_header(decoder.get(), bytes, where).size;
}

image8 decode_jpeg(std::vector<u8> const& bytes, std::string const& where) {
  tj_handle const decoder(tjInitDecompress());
  if (!decoder) refuse(where, tjGetErrorStr2(nullptr));
  auto const [size, colorspace] = read_header(decoder.get(), bytes, where);
  if (colorspace == TJCS_CMYK || colorspace == TJCS_YCCK) {
    throw io_error(where, "is a CMYK JPEG", "convert it to RGB");
  }
  // A block of 64 pixels costs a Huffman coder at least a bit, 512 pixels a byte. A size beyond twice that is a lie,
  // and must not be allocated.
  if (static_cast<u64>(size.width) * static_cast<u64>(size.height) > static_cast<u64>(bytes.size()) * 1024) {
    refuse(where, "the size in its header is larger than its data can hold");
  }
  bool const gray = colorspace == TJCS_GRAY;
  image8 image(size.width, size.height, gray ? 1 : 3);
  if (tjDecompress2(decoder.get(), bytes.data(), bytes.size(), image.data.data(), size.width, 0, size.height,
                    gray ? TJPF_GRAY : TJPF_RGB, TJFLAG_ACCURATEDCT | TJFLAG_LIMITSCANS) != 0) {
    // Stray bytes between segments lose nothing; every other warning means pixels that are made up.
    std::string const what = tjGetErrorStr2(decoder.get());
    bool const harmless =
        tjGetErrorCode(decoder.get()) == TJERR_WARNING && what.find("extraneous") != std::string::npos;
    if (!harmless) refuse(where, what);
  }
  return image;
}

}  // namespace io

std::vector<u8> encode_jpeg(image8 const& image, int quality) {
  if (image.width < 1 || image.height < 1 || (image.channels != 1 && image.channels != 3) ||
      image.data.size() != static_cast<std::size_t>(image.width) * image.height * image.channels) {
    throw invalid_argument("a JPEG needs an image of 1 or 3 channels that is not empty; composite alpha first");
  }
  if (quality < 1 || quality > 100) throw invalid_argument("JPEG quality must lie in 1..100");
  io::tj_handle const encoder(tjInitCompress());
  bool const gray = image.channels == 1;
  unsigned char* data = nullptr;
  unsigned long size = 0;
  int const code =
      encoder ? tjCompress2(encoder.get(), image.data.data(), image.width, 0, image.height, gray ? TJPF_GRAY : TJPF_RGB,
                            &data, &size, gray ? TJSAMP_GRAY : TJSAMP_444, quality, TJFLAG_ACCURATEDCT)
              : -1;
  std::unique_ptr<unsigned char, void (*)(unsigned char*)> const owner(data, tjFree);
  if (code != 0) throw error(std::string("libjpeg-turbo could not encode an image: ") + tjGetErrorStr2(encoder.get()));
  return std::vector<u8>(data, data + size);
}

}  // namespace gart
