#pragma once
/// \file
/// The mean of a block of pixels, 8 bits a channel: a pixel of a smaller photograph. Pixels of 4 channels have straight
/// alpha, and colours are weighted by it; a mask's weights weigh both.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

namespace gart { inline namespace GART_ISA {

/// Where the blocks of an image lie.
struct pixel_blocks {
  std::size_t width = 0;   ///< of the image, pixels
  std::size_t factor = 1;  ///< side of a block, pixels
  std::size_t across = 0;  ///< blocks in a row; what is left of the image's width is in none

  /// f(pixel) of the image's pixels in a block, by its number, row by row.
  template <class F>
  GART_HD GART_INLINE void each(std::size_t block, F&& f) const {
    std::size_t const y = block / across, x = block - y * across;
    for (std::size_t v = 0; v < factor; ++v)
      for (std::size_t u = 0; u < factor; ++u) f((y * factor + v) * width + x * factor + u);
  }
};

/// Writes the mean of a block of an image, [H][W][channels], to `out`, [channels]. Returns the mean of its mask's
/// weights, [H][W] or null, in parts of 255. It is not 0 where one of them is not. What counts for nothing is black.
GART_HD GART_INLINE u8 block_mean(u8 const* image, int channels, u8 const* mask, pixel_blocks const& blocks,
                                  std::size_t block, u8* out) {
  bool const alpha = channels == 4;
  int const colors = alpha ? 3 : channels;
  u64 sum[4] = {}, opaque = 0, counted = 0;
  blocks.each(block, [&](std::size_t pixel) {
    u8 const* const p = image + pixel * static_cast<std::size_t>(channels);
    u64 const kept = mask ? mask[pixel] : 1, weight = alpha ? kept * p[3] : kept;
    counted += kept, opaque += weight;
    for (int c = 0; c < colors; ++c) sum[c] += weight * p[c];
  });
  for (int c = 0; c < colors; ++c) out[c] = opaque ? static_cast<u8>((sum[c] + opaque / 2) / opaque) : u8{0};
  if (alpha) out[3] = counted ? static_cast<u8>((opaque + counted / 2) / counted) : u8{0};
  if (!mask) return 255;
  u64 const area = blocks.factor * blocks.factor, mean = (counted + area / 2) / area;
  return static_cast<u8>(counted && !mean ? 1 : mean);
}

}}  // namespace gart::GART_ISA
