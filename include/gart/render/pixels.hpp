#pragma once
// The order in which pixels are traced: blocks of 8 x 4, so that the threads of a warp, and a core's cache, see
// neighbouring rays. Launches are padded to whole blocks.

#include <gart/camera/pixel_rays.hpp>
#include <gart/trace/packet_block.hpp>

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

GART_HD GART_INLINE primary_ray pixel_ray(pixel_rays const& rays, pixel p) { return rays.of(p.x, p.y); }

// Host side, of any camera.
inline primary_ray pixel_ray(camera const& c, pixel p) {
  return {ray_direction(c, static_cast<float>(p.x) + 0.5f, static_cast<float>(p.y) + 0.5f)};
}

#if !defined(__CUDACC__)
// The directions of a packet's rays, the same bits. Beyond the image they are some pixel's.
inline vec3_of<lanes> pixel_directions(pixel_rays const& rays, packet_block const& block) {
  if (!rays.directions) return rays.view.ray(block.centres_x(), block.centres_y()).direction;
  vec3_of<lanes> out;
  for (int l = 0; l < lane_count; ++l) {
    int const x = block.x + packet_block::column(l), y = block.y + packet_block::row(l);
    vec3 const d = rays.of(x < rays.view.width ? x : block.x, y < rays.view.height ? y : block.y).direction;
    out.x.v[l] = d.x, out.y.v[l] = d.y, out.z.v[l] = d.z;
  }
  return out;
}
#endif

}  // namespace gart::inline GART_ISA
