// OpenEXR files: one part of scan lines (https://openexr.com/en/latest/OpenEXRFileLayout.html).

#include "bytes.hpp"
#include "compression.hpp"

#include <gart/core/error.hpp>
#include <gart/io/exr_file.hpp>
#include <gart/io/file.hpp>

#include <algorithm>
#include <numeric>
#include <string>
#include <vector>

namespace gart {
namespace {

constexpr int lines_together = 16;  // of compression ZIP
constexpr char zip = 3;

using io::put;

void put_attribute(std::string& out, char const* name, char const* type, std::string const& value) {
  out.append(name).push_back('\0');
  out.append(type).push_back('\0');
  put(out, static_cast<std::int32_t>(value.size()));
  out += value;
}

template <class... T>
std::string packed(T... values) {
  std::string out;
  (put(out, values), ...);
  return out;
}

std::string header_of(image_float const& image, std::string_view channels, std::vector<std::size_t> const& order) {
  std::string out = packed(std::int32_t{20000630}, std::int32_t{2}), list;
  for (std::size_t const c : order) {
    list.push_back(channels[c]), list.push_back('\0');
    list += packed(std::int32_t{2}, std::int32_t{0}, std::int32_t{1}, std::int32_t{1});  // floats, one a pixel
  }
  list.push_back('\0');
  std::string const window =
      packed(std::int32_t{0}, std::int32_t{0}, std::int32_t{image.width - 1}, std::int32_t{image.height - 1});
  put_attribute(out, "channels", "chlist", list);
  put_attribute(out, "compression", "compression", packed(zip));
  put_attribute(out, "dataWindow", "box2i", window);
  put_attribute(out, "displayWindow", "box2i", window);
  put_attribute(out, "lineOrder", "lineOrder", packed(char{0}));
  put_attribute(out, "pixelAspectRatio", "float", packed(1.0f));
  put_attribute(out, "screenWindowCenter", "v2f", packed(0.0f, 0.0f));
  put_attribute(out, "screenWindowWidth", "float", packed(1.0f));
  out.push_back('\0');
  return out;
}

// The even bytes, then the odd ones, each as its difference from the one before. So alike bytes of floats stand
// together.
std::vector<u8> predicted(std::string const& raw) {
  std::vector<u8> out(raw.size());
  std::size_t const half = (raw.size() + 1) / 2;
  for (std::size_t i = 0; i < raw.size(); ++i) out[(i % 2 ? half : 0) + i / 2] = static_cast<u8>(raw[i]);
  for (std::size_t i = out.size(); i-- > 1;) out[i] = static_cast<u8>(out[i] - out[i - 1] + 128);
  return out;
}

}  // namespace

void write_exr(std::filesystem::path const& path, image_float const& image, std::string_view channels) {
  std::size_t const count = static_cast<std::size_t>(image.channels), width = static_cast<std::size_t>(image.width);
  std::vector<std::size_t> order(count);
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (channels.size() != count || image.data.empty())
    throw invalid_argument("write_exr: " + path.string() + ": " + std::to_string(channels.size()) +
                           " names for the channels of an image of " + std::to_string(count) +
                           " (name each by a letter; an empty image has no file)");
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return channels[a] < channels[b]; });
  std::string out = header_of(image, channels, order), blocks;
  int const all = (image.height + lines_together - 1) / lines_together;
  std::size_t const first = out.size() + std::size_t{8} * static_cast<std::size_t>(all);
  for (int block = 0; block < all; ++block) {
    put(out, static_cast<u64>(first + blocks.size()));
    int const top = block * lines_together, under = std::min(image.height, top + lines_together);
    std::string raw;
    for (int y = top; y < under; ++y)
      for (std::size_t const c : order)
        for (std::size_t x = 0; x < width; ++x)
          put(raw, image.data[(static_cast<std::size_t>(y) * width + x) * count + c]);
    std::vector<u8> const small = io::zlib_stream(predicted(raw), path.string());
    bool const pays = small.size() < raw.size();  // else it is stored as it is, which readers tell by its size
    put(blocks, static_cast<std::int32_t>(top));
    put(blocks, static_cast<std::int32_t>(pays ? small.size() : raw.size()));
    pays ? blocks.append(reinterpret_cast<char const*>(small.data()), small.size()) : blocks.append(raw);
  }
  out += blocks;
  write_file(path, out);
}

}  // namespace gart
