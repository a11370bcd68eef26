#pragma once
/// \file
/// How a photograph shows the scene's colours: darkened by the lens (exposure/vignetting.hpp), then exposed
/// (exposure/exposure.hpp), x' = M (V x) + b.

#include <gart/exposure/exposure.hpp>
#include <gart/exposure/vignetting.hpp>
#include <gart/scene/image.hpp>

namespace gart {

/// The response of one view; the default changes nothing.
struct photo_response {
  exposure exposed;     ///< the photograph's exposure
  vignetting falloff;   ///< its lens's falloff,
  image_circle circle;  ///< on its image

  /// V of a channel at a pixel.
  GART_HD GART_INLINE float gain(int channel, int x, int y) const {
    return falloff.gain(channel, circle.square(static_cast<float>(x), static_cast<float>(y)));
  }
};

}  // namespace gart

namespace gart { inline namespace GART_ISA {

/// Applies a response to every pixel of an image of three channels.
inline void apply(photo_response const& response, image_float& image) {
  float* x = image.data.data();
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column, x += 3) {
      float seen[3];
      for (int c = 0; c < 3; ++c) seen[c] = response.gain(c, column, row) * x[c];
      for (int c = 0; c < 3; ++c) x[c] = response.exposed.channel(c, seen[0], seen[1], seen[2]);
    }
  }
}

}}  // namespace gart::GART_ISA
