#include "exif.hpp"

#include <cstring>

namespace gart::io {

namespace {

constexpr u8 segment = 0xff, start_of_scan = 0xda, application_1 = 0xe1;
constexpr u32 orientation_tag = 0x0112;

// Numbers of the TIFF within, of either endianness; 0 past its end.
struct tiff {
  u8 const* bytes;
  std::size_t size;
  bool big;
  u32 number(std::size_t at, std::size_t width) const {
    if (at > size || size - at < width) return 0;
    u32 value = 0;
    for (std::size_t i = 0; i < width; ++i) value |= u32{bytes[at + i]} << 8 * (big ? width - 1 - i : i);
    return value;
  }
};

int orientation_in(tiff const& t) {
  std::size_t const list = t.number(4, 4), count = t.number(list, 2);
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t const entry = list + 2 + 12 * i;
    if (entry >= t.size) break;
    if (t.number(entry, 2) != orientation_tag) continue;
    u32 const value = t.number(entry + 8, 2);
    return value >= 1 && value <= 8 ? static_cast<int>(value) : 1;
  }
  return 1;
}

}  // namespace

int exif_orientation(std::vector<u8> const& jpeg) {
  std::size_t at = 2;
  while (at + 4 <= jpeg.size() && jpeg[at] == segment && jpeg[at + 1] != start_of_scan) {
    std::size_t const length = std::size_t{jpeg[at + 2]} << 8 | jpeg[at + 3], body = at + 4;
    if (length < 2 || length - 2 > jpeg.size() - body) break;
    if (jpeg[at + 1] == application_1 && length >= 16 && std::memcmp(&jpeg[body], "Exif\0", 6) == 0)
      return orientation_in({&jpeg[body + 6], length - 8, jpeg[body + 6] == 'M'});
    at = body + length - 2;
  }
  return 1;
}

}  // namespace gart::io
