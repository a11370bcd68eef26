#pragma once
/// \file
/// The order in which pixels are traced: blocks of 8 x 4. So the threads of a warp, and a core's cache, see
/// neighbouring rays. Launches are padded to whole blocks.

#include <gart/core/isa.hpp>
#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>
#include <gart/scene/image_rows.hpp>

#include <cstddef>

namespace gart { inline namespace GART_ISA {

/// A pixel, (0, 0) at the upper left.
struct pixel {
  int x, y;  ///< column and row
};

/// Ray i of a launch over an image is at(i).
struct pixel_order {
  static constexpr int block_width = 8, block_height = 4;  ///< in pixels
  int width = 0, height = 0;                               ///< of the image, in pixels
  image_rows rows = {};                                    ///< what is traced of it

  /// Blocks across the image, the last one cut.
  GART_HD int blocks_x() const { return (width + block_width - 1) / block_width; }
  /// Blocks down the image, the last one cut.
  GART_HD int blocks_y() const { return (height + block_height - 1) / block_height; }
  /// Rays of a launch: the pixels of all blocks, those beyond the image too.
  GART_HD index_t launch_size() const {
    return static_cast<index_t>(blocks_x()) * static_cast<index_t>(blocks_y()) * block_width * block_height;
  }
  /// The pixel of ray i.
  GART_HD pixel at(index_t i) const {
    index_t const block = i / (block_width * block_height), lane = i % (block_width * block_height);
    index_t const columns = static_cast<index_t>(blocks_x());
    return {static_cast<int>(block % columns * block_width + lane % block_width),
            static_cast<int>(block / columns * block_height + lane / block_width)};
  }
  /// The ray of a pixel, the way back of at().
  GART_HD index_t index(pixel p) const {
    index_t const x = static_cast<index_t>(p.x), y = static_cast<index_t>(p.y);
    index_t const block = y / block_height * static_cast<index_t>(blocks_x()) + x / block_width;
    return block * (block_width * block_height) + y % block_height * block_width + x % block_width;
  }
  /// Whether the pixel is of the image's rows that are traced, not of a block's part beyond it.
  GART_HD bool inside(pixel p) const { return p.x < width && p.y < height && rows.contains(p.y); }
  /// Its place in an array [H][W].
  GART_HD std::size_t address(pixel p) const { return static_cast<std::size_t>(p.y) * width + p.x; }
};

}}  // namespace gart::GART_ISA
