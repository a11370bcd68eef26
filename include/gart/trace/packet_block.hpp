#pragma once
/// \file
/// The pixels that a packet's lanes stand for (trace/packet_walk.hpp, backward/packet_gather.hpp).

#include <gart/math/lanes.hpp>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

/// The pixels of a packet: 4 wide, as high as there are lanes for.
struct packet_block {
  static constexpr int width = 4, height = lane_count / width;  ///< in pixels
  int x = 0, y = 0;                                             ///< column and row of its first pixel

  /// Of a lane's pixel, from the first.
  static constexpr int column(int lane) { return lane % width; }
  /// Of a lane's pixel, from the first.
  static constexpr int row(int lane) { return lane / width; }
  /// The middle of each lane's pixel.
  lanes centres_x() const {
    lanes r;
    for (int l = 0; l < lane_count; ++l) r.v[l] = static_cast<float>(column(l));
    return lanes(static_cast<float>(x)) + r + lanes(0.5f);
  }
  /// The same, down the image.
  lanes centres_y() const {
    lanes r;
    for (int l = 0; l < lane_count; ++l) r.v[l] = static_cast<float>(row(l));
    return lanes(static_cast<float>(y)) + r + lanes(0.5f);
  }
};

}}  // namespace gart::GART_ISA

#endif
