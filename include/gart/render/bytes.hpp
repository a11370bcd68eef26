#pragma once
/// \file
/// Converts an image's colour to 8 bits a channel where it was rendered. Floats [H][W][3] become [H][W][3], or
/// [H][W][4] with 255 as a fourth channel. Clamped and rounded as to_8bit (io/image_file.hpp) does it; NaN becomes 0.
/// Cost: a launch over the pixels.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>
#include <gart/exec/concepts.hpp>

namespace gart { inline namespace GART_ISA {

namespace render_kernels {

struct color_to_bytes {
  float const* color;
  u8* bytes;
  int channels;
  GART_KERNEL void operator()(index_t pixel) const {
    u8* const out = bytes + static_cast<std::size_t>(channels) * pixel;
    for (int c = 0; c < 3; ++c) {
      float const v = color[std::size_t{3} * pixel + c];
      out[c] = static_cast<u8>(v > 0 ? (v < 1 ? v : 1.0f) * 255.0f + 0.5f : 0.0f);
    }
    if (channels == 4) out[3] = 255;
  }
};

}  // namespace render_kernels

/// Colours [pixels][3], floats, to `bytes`, [pixels][channels], 3 or 4 channels. 0 to 1 becomes 0 to 255, rounded and
/// clamped; a fourth channel is 255.
template <execution E>
void color_to_bytes(E& exec, float const* color, index_t pixels, u8* bytes, int channels) {
  parallel_for(exec, "8 bits", pixels, render_kernels::color_to_bytes{color, bytes, channels});
}

}}  // namespace gart::GART_ISA
