// Light of all directions: OpenEXR, or Radiance's RGBE (https://radsite.lbl.gov/radiance/refer/filefmts.pdf).

#include "bytes.hpp"

#include <gart/io/exr_file.hpp>
#include <gart/io/file.hpp>

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gart {
namespace {

using namespace io;

constexpr float largest_half = 65504;

class rgbe_reader {
 public:
  rgbe_reader(std::filesystem::path const& path, std::vector<u8> const& bytes)
      : name_(path.string()), rest_(reinterpret_cast<char const*>(bytes.data()), bytes.size()) {}

  image_float read() {
    std::string_view line;
    bool known = true;
    while (next_line(rest_, line) && !line.empty())
      if (line.starts_with("FORMAT=")) known = line == "FORMAT=32-bit_rle_rgbe";
    if (!known) refuse("has another FORMAT than 32-bit_rle_rgbe", "save it as RGBE, or as EXR");
    next_line(rest_, line);
    int width = 0, height = 0;
    if (next_word(line) != "-Y" || !parse_number(next_word(line), height) || next_word(line) != "+X" ||
        !parse_number(next_word(line), width) || width < 1 || height < 1 || width > 65536 || height > 65536)
      refuse("has no line '-Y HEIGHT +X WIDTH' after its header", "save it from top to bottom, left to right");
    auto const w = static_cast<std::size_t>(width);
    // A run of 127 equal bytes takes 2.
    if (w * static_cast<std::size_t>(height) / 64 > rest_.size() + 64) refuse_short();
    image_float image(width, height, 3);
    std::vector<u8> rgbe(4 * w);
    for (int y = 0; y < height; ++y) {
      read_line(rgbe, w);
      for (std::size_t x = 0; x < w; ++x)
        for (std::size_t c = 0; c < 3; ++c)
          image.at(static_cast<int>(x), y, static_cast<int>(c)) =
              rgbe[4 * x + 3] ? std::ldexp(static_cast<float>(rgbe[4 * x + c]), rgbe[4 * x + 3] - 136) : 0.0f;
    }
    return image;
  }

 private:
  [[noreturn]] void refuse(std::string const& what, std::string const& remedy) const {
    throw io_error(name_, what, remedy);
  }
  [[noreturn]] void refuse_short() const {
    refuse("ends within its pixels", "the file is truncated: copy or export it again");
  }
  u8 next() {
    if (rest_.empty()) refuse_short();
    auto const byte = static_cast<u8>(rest_[0]);
    rest_.remove_prefix(1);
    return byte;
  }

  void read_line(std::vector<u8>& rgbe, std::size_t w) {
    u8 const a = next(), b = next(), c = next(), d = next();
    if (w < 8 || w > 32767 || a != 2 || b != 2 || (static_cast<std::size_t>(c) << 8 | d) != w) {  // pixels as they are
      rgbe[0] = a, rgbe[1] = b, rgbe[2] = c, rgbe[3] = d;
      if (rest_.size() < 4 * (w - 1)) refuse_short();
      std::memcpy(rgbe.data() + 4, rest_.data(), 4 * (w - 1));
      rest_.remove_prefix(4 * (w - 1));
      return;
    }
    for (std::size_t channel = 0; channel < 4; ++channel)
      for (std::size_t x = 0; x < w;) {
        u8 const count = next();
        std::size_t const n = count > 128 ? count - 128u : count;
        if (n == 0 || n > w - x) refuse("has a run of pixels longer than its line", "export it again");
        u8 value = count > 128 ? next() : u8{0};
        for (std::size_t i = 0; i < n; ++i, ++x) rgbe[4 * x + channel] = count > 128 ? value : next();
      }
  }

  std::string name_;
  std::string_view rest_;
};

}  // namespace

image_float read_radiance(std::filesystem::path const& path) {
  std::vector<u8> const bytes = read_file(path);
  std::string_view const text(reinterpret_cast<char const*>(bytes.data()), bytes.size());
  if (!text.starts_with("#?") && !text.starts_with("\x76\x2f\x31\x01"))
    throw io_error(path.string(), "is neither OpenEXR nor Radiance HDR", "convert it to one of them");
  image_float image = text.starts_with("#?") ? rgbe_reader(path, bytes).read() : read_exr(path);
  for (float& v : image.data) v = v > 0 ? std::min(v, largest_half) : 0.0f;  // NaN becomes 0
  return image;
}

}  // namespace gart
