#pragma once
/// \file
/// The exposure of a photograph relative to the scene's colours. It is x' = M x + b on the composited colour, with a 3
/// x 3 matrix M, as in 3DGS. Cameras with automatic exposure and white balance take neighbouring photographs of
/// different brightness. Gaussians alone can only learn that as haze in front of the cameras.

#include <gart/core/macros.hpp>
#include <gart/math/arith.hpp>

namespace gart {

/// An affine map of colours.
struct exposure {
  static constexpr int floats = 12;                        ///< numbers of a map
  float m[floats] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};  ///< [3][4]: a row of M, then its offset

  /// Channel c of the colour (r, g, b), exposed.
  GART_HD GART_INLINE float channel(int c, float r, float g, float b) const {
    return fma(m[4 * c], r, fma(m[4 * c + 1], g, fma(m[4 * c + 2], b, m[4 * c + 3])));
  }
};

}  // namespace gart
