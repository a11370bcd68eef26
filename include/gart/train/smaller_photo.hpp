#pragma once
/// \file
/// A step's photograph and depth map at the size of its image (train/resolution.hpp), as means of blocks. They are made
/// anew in each step: reading a photograph costs little beside tracing its rays. Memory: one image.

#include <gart/exec/buffer.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/loss/image_loss.hpp>
#include <gart/scene/block_mean.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct shrink_photo_kernel {
  truth_view photo;
  pixel_blocks blocks;
  u8* pixels;
  u8* mask;  // where the photo has one
  GART_KERNEL void operator()(index_t i) const {
    u8* const out = pixels + std::size_t{i} * static_cast<std::size_t>(photo.channels);
    u8 const kept = block_mean(photo.pixels, photo.channels, photo.mask, blocks, i, out);
    if (mask) mask[i] = kept;
  }
};

// The mean of a block's measured distances.
struct shrink_map_kernel {
  float const* map;
  pixel_blocks blocks;
  float* out;
  GART_KERNEL void operator()(index_t i) const {
    float sum = 0, count = 0;
    blocks.each(i, [&](std::size_t pixel) {
      if (map[pixel] > 0) sum += map[pixel], count += 1;
    });
    out[i] = count > 0 ? sum / count : 0;
  }
};

}  // namespace detail

/// The photograph of the last step that called it.
template <execution E>
class smaller_photo {
 public:
  /// No buffer is allocated yet.
  explicit smaller_photo(E& exec) : exec_(&exec), pixels_(exec), mask_(exec), map_(exec) {}

  /// Shrinks a photograph of so many pixels; by 1 it is returned itself.
  truth_view shrink(truth_view photo, int width, int height, int by) {
    if (by == 1) return photo;
    index_t const count = blocks_in(height, width, by);
    pixels_.resize(std::size_t{count} * static_cast<std::size_t>(photo.channels));
    if (photo.mask) mask_.resize(count);
    u8* const mask = photo.mask ? mask_.data() : nullptr;
    parallel_for(*exec_, "shrink_photo", count,
                 detail::shrink_photo_kernel{photo, blocks_of(width, by), pixels_.data(), mask});
    photo.pixels = pixels_.data(), photo.mask = mask;
    return photo;
  }
  /// Shrinks a depth map.
  float const* shrink(float const* map, int width, int height, int by) {
    if (by == 1) return map;
    index_t const count = blocks_in(height, width, by);
    map_.resize(count);
    parallel_for(*exec_, "shrink_map", count, detail::shrink_map_kernel{map, blocks_of(width, by), map_.data()});
    return map_.data();
  }

 private:
  static pixel_blocks blocks_of(int width, int by) {
    return {static_cast<std::size_t>(width), static_cast<std::size_t>(by), static_cast<std::size_t>(width / by)};
  }
  static index_t blocks_in(int height, int width, int by) { return static_cast<index_t>((width / by) * (height / by)); }

  E* exec_;
  buffer<u8, E> pixels_, mask_;
  buffer<float, E> map_;
};

}}  // namespace gart::GART_ISA
