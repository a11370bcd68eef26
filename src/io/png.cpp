// PNG through libpng, which reports errors by longjmp. Between setjmp and the last libpng call no object with a
// destructor is created.

#include "codec.hpp"

#include <gart/core/error.hpp>
#include <gart/io/image_file.hpp>

#include <png.h>

#include <csetjmp>
#include <cstring>
#include <new>

namespace gart {
namespace io {
namespace {

struct png_state {
  std::vector<u8> const* source = nullptr;
  std::size_t position = 0;
  std::vector<u8>* sink = nullptr;
  char message[160] = {};
};

void on_error(png_structp png, png_const_charp text) {
  auto* state = static_cast<png_state*>(png_get_error_ptr(png));
  std::strncpy(state->message, text, sizeof state->message - 1);
  png_longjmp(png, 1);
}

void on_warning(png_structp, png_const_charp) {}

// libpng's two structs, which go even where the pixels find no memory.
struct png_reader {
  png_structp png;
  png_infop info;
  explicit png_reader(png_state& state)
      : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, &state, on_error, on_warning)),
        info(png ? png_create_info_struct(png) : nullptr) {}
  ~png_reader() { png_destroy_read_struct(&png, &info, nullptr); }
  png_reader(png_reader const&) = delete;
  png_reader& operator=(png_reader const&) = delete;
};

void pull(png_structp png, png_bytep out, std::size_t count) {
  auto* state = static_cast<png_state*>(png_get_io_ptr(png));
  if (count > state->source->size() - state->position) png_error(png, "the file is truncated");
  std::memcpy(out, state->source->data() + state->position, count);
  state->position += count;
}

void push(png_structp png, png_bytep data, std::size_t count) {
  auto* state = static_cast<png_state*>(png_get_io_ptr(png));
  bool full = false;
  try {
    state->sink->insert(state->sink->end(), data, data + count);
  } catch (std::bad_alloc const&) {
    full = true;
  }
  if (full) png_error(png, "out of memory");
}

void flush(png_structp) {}

// Pixels of bytes, whatever the file has; or of 16 bits, little-endian, of which it must have one channel.
template <class T>
bool decode(png_structp png, png_infop info, png_state& state, basic_image<T>& image) {
  constexpr bool bytes = sizeof(T) == 1;
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_read_fn(png, &state, pull);
  // Nothing but the pixels: libpng would allocate whatever length a text or profile promises, for a warning.
  png_set_keep_unknown_chunks(png, PNG_HANDLE_CHUNK_NEVER, nullptr, -1);
  png_read_info(png, info);
  int const kind = png_get_color_type(png, info);
  if (!bytes && (kind != PNG_COLOR_TYPE_GRAY || png_get_bit_depth(png, info) != 16))
    png_error(png, "it is not one channel of 16 bits");
  // Deflate expands at most 1032 times: a size beyond that is a lie, and must not be allocated.
  if (png_get_rowbytes(png, info) > (state.source->size() * 1040 + 4096) / png_get_image_height(png, info)) {
    png_error(png, "the size in its header is larger than its data can hold");
  }
  if (bytes) {
    png_set_expand(png);  // palette to RGB, fewer than 8 bits to 8, tRNS to alpha
    png_set_scale_16(png);
    if ((kind & PNG_COLOR_MASK_ALPHA) || png_get_valid(png, info, PNG_INFO_tRNS)) png_set_gray_to_rgb(png);
  } else {
    png_set_swap(png);
  }
  int const passes = png_set_interlace_handling(png);
  png_read_update_info(png, info);
  image.width = static_cast<int>(png_get_image_width(png, info));
  image.height = static_cast<int>(png_get_image_height(png, info));
  image.channels = png_get_channels(png, info);
  std::size_t const row = png_get_rowbytes(png, info) / sizeof(T);
  image.data.resize(row * static_cast<std::size_t>(image.height));
  for (int pass = 0; pass < passes; ++pass) {
    for (int y = 0; y < image.height; ++y)
      png_read_row(png, reinterpret_cast<png_bytep>(image.data.data() + row * static_cast<std::size_t>(y)), nullptr);
  }
  png_read_end(png, nullptr);
  return true;
}

template <class T>
basic_image<T> decoded(std::vector<u8> const& bytes, std::string const& where, char const* fault, char const* remedy) {
  png_state state;
  state.source = &bytes;
  basic_image<T> image;
  png_reader const reader(state);
  if (!reader.info || !decode(reader.png, reader.info, state, image))
    throw io_error(where, std::string(fault) + state.message, remedy);
  return image;
}

// bits: of a channel, whose rows follow each other at `data`; 16 are little-endian.
bool encode(png_structp png, png_infop info, png_state& state, int width, int height, int channels, int bits,
            u8 const* data) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_write_fn(png, &state, push, flush);
  int const kind = channels == 1 ? PNG_COLOR_TYPE_GRAY : channels == 3 ? PNG_COLOR_TYPE_RGB : PNG_COLOR_TYPE_RGB_ALPHA;
  png_set_IHDR(png, info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), bits, kind,
               PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (bits == 16) png_set_swap(png);
  std::size_t const row = static_cast<std::size_t>(width) * static_cast<std::size_t>(channels * bits / 8);
  for (int y = 0; y < height; ++y) png_write_row(png, data + row * static_cast<std::size_t>(y));
  png_write_end(png, nullptr);
  return true;
}

std::vector<u8> encoded(int width, int height, int channels, int bits, u8 const* data) {
  std::vector<u8> bytes;
  png_state state;
  state.sink = &bytes;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &state, on_error, on_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  bool const done = info && encode(png, info, state, width, height, channels, bits, data);
  png_destroy_write_struct(&png, &info);
  if (!done) throw error(std::string("libpng could not encode an image: ") + state.message);
  return bytes;
}

}  // namespace

bool is_png(std::vector<u8> const& bytes) { return bytes.size() >= 8 && png_sig_cmp(bytes.data(), 0, 8) == 0; }

image8 decode_png(std::vector<u8> const& bytes, std::string const& where) {
  return decoded<u8>(bytes, where, "is not a readable PNG: ", "replace the file");
}

basic_image<u16> decode_png16(std::vector<u8> const& bytes, std::string const& where) {
  return decoded<u16>(bytes, where,
                      "is not a depth map in PNG: ", "store one channel of 16 bits, 0 where nothing was measured");
}

std::vector<u8> encode_png16(basic_image<u16> const& image) {
  return encoded(image.width, image.height, 1, 16, reinterpret_cast<u8 const*>(image.data.data()));
}

image_size png_size(std::vector<u8> const& bytes, std::string const& where) {
  auto const big_endian = [&](std::size_t at) {
    return (u32{bytes[at]} << 24) | (u32{bytes[at + 1]} << 16) | (u32{bytes[at + 2]} << 8) | u32{bytes[at + 3]};
  };
  if (bytes.size() < 24) throw io_error(where, "is not a readable PNG: the file is truncated", "replace the file");
  u32 const width = big_endian(16), height = big_endian(20);
  if (width - 1 >= 1000000 || height - 1 >= 1000000) {
    throw io_error(where, "is not a readable PNG: its size is out of range", "replace the file");
  }
  return {static_cast<int>(width), static_cast<int>(height)};
}

}  // namespace io

std::vector<u8> encode_png(image8 const& image) {
  if (image.width < 1 || image.height < 1 || (image.channels != 1 && image.channels != 3 && image.channels != 4) ||
      image.data.size() != static_cast<std::size_t>(image.width) * image.height * image.channels) {
    throw invalid_argument("a PNG needs an image of 1, 3 or 4 channels that is not empty");
  }
  return io::encoded(image.width, image.height, image.channels, 8, image.data.data());
}

}  // namespace gart
