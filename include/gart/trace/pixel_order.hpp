#pragma once
// The order in which pixels are traced: blocks of 8 x 4, so that the threads of a warp, and a core's cache, see
// neighbouring rays. Launches are padded to whole blocks.

#include <gart/core/isa.hpp>
#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

#include <cstddef>

namespace gart::inline GART_ISA {

struct pixel {
  int x, y;
};

struct pixel_order {
  static constexpr int block_width = 8, block_height = 4;
  int width = 0, height = 0;

  GART_HD int blocks_x() const { return (width + block_width - 1) / block_width; }
  GART_HD int blocks_y() const { return (height + block_height - 1) / block_height; }
  GART_HD index_t launch_size() const {
    return static_cast<index_t>(blocks_x()) * static_cast<index_t>(blocks_y()) * block_width * block_height;
  }
  GART_HD pixel at(index_t i) const {
    index_t const block = i / (block_width * block_height), lane = i % (block_width * block_height);
    index_t const columns = static_cast<index_t>(blocks_x());
    return {static_cast<int>(block % columns * block_width + lane % block_width),
            static_cast<int>(block / columns * block_height + lane / block_width)};
  }
  GART_HD index_t index(pixel p) const {
    index_t const x = static_cast<index_t>(p.x), y = static_cast<index_t>(p.y);
    index_t const block = y / block_height * static_cast<index_t>(blocks_x()) + x / block_width;
    return block * (block_width * block_height) + y % block_height * block_width + x % block_width;
  }
  GART_HD bool inside(pixel p) const { return p.x < width && p.y < height; }
  GART_HD std::size_t address(pixel p) const { return static_cast<std::size_t>(p.y) * width + p.x; }
};

}  // namespace gart::inline GART_ISA
