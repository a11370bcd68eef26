#pragma once
// The pixels that a packet's lanes stand for (trace/packet_walk.hpp, backward/packet_gather.hpp).

#include <gart/math/lanes.hpp>
#include <gart/tiles/grid.hpp>

#if !defined(__CUDACC__)

namespace gart {

// The pixels of a packet: 4 wide, as high as there are lanes for.
struct packet_block {
  static constexpr int width = 4, height = lane_count / width;
  int x = 0, y = 0;

  static constexpr int column(int lane) { return lane % width; }
  static constexpr int row(int lane) { return lane / width; }
  GART_INLINE bool overlaps(pixel_box const& b) const {
    return b.x0 < x + width && b.x1 > x && b.y0 < y + height && b.y1 > y;
  }
  // The middle of each lane's pixel.
  lanes centres_x() const {
    lanes r;
    for (int l = 0; l < lane_count; ++l) r.v[l] = static_cast<float>(column(l));
    return lanes(static_cast<float>(x)) + r + lanes(0.5f);
  }
  lanes centres_y() const {
    lanes r;
    for (int l = 0; l < lane_count; ++l) r.v[l] = static_cast<float>(row(l));
    return lanes(static_cast<float>(y)) + r + lanes(0.5f);
  }
  // The lanes whose pixels lie in the box.
  GART_INLINE lane_mask within(pixel_box const& b) const {
    constexpr u32 first_column = lane_count == 16 ? 0x1111u : lane_count == 8 ? 0x11u : 1u;
    u32 const columns = (1u << clamped(b.x1 - x, width)) - (1u << clamped(b.x0 - x, width));
    u32 const rows = (1u << width * clamped(b.y1 - y, height)) - (1u << width * clamped(b.y0 - y, height));
    return lanes_of(columns * first_column & rows);
  }

 private:
  GART_INLINE static int clamped(int v, int most) { return v < 0 ? 0 : v > most ? most : v; }
};

}  // namespace gart

#endif
