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
  bool overlaps(pixel_box const& b) const { return b.x0 < x + width && b.x1 > x && b.y0 < y + height && b.y1 > y; }
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
  lane_mask within(pixel_box const& b) const {
    u32 const columns = span_of(b.x0 - x, b.x1 - x, width), rows = span_of(b.y0 - y, b.y1 - y, height);
    u32 bits = 0;
    for (int r = 0; r < height; ++r) bits |= (rows >> r & 1u ? columns : 0u) << (r * width);
    return lanes_of(bits);
  }

 private:
  // Bits [from, to) of the lowest n.
  static u32 span_of(int from, int to, int n) {
    u32 const below = from < 0 ? 0u : from > n ? (1u << n) - 1 : (1u << from) - 1;
    u32 const upto = to < 0 ? 0u : to > n ? (1u << n) - 1 : (1u << to) - 1;
    return upto & ~below;
  }
};

}  // namespace gart

#endif
