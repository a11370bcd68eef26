#pragma once
/// \file
/// The falloff of a lens: towards the corners of its images the same light makes a darker pixel. Each channel is
/// multiplied by
///   V(u) = 1 + k0 u + k1 u^2 + k2 u^3,   u = (the distance from the principal point over half of the diagonal)^2,
/// the same for all photographs of a lens. A scene has no such falloff. A surface may lie in the middle of one
/// photograph and in the corner of another. Gaussians can only explain the difference by haze.

#include <gart/core/macros.hpp>
#include <gart/math/arith.hpp>
#include <gart/scene/camera.hpp>

#include <cmath>

namespace gart {

/// The falloff of a lens; none where all is zero.
struct vignetting {
  static constexpr int powers = 3, floats = 3 * powers;  ///< numbers of a channel, and of a falloff
  float k[floats] = {};                                  ///< [3][3]: for each channel the factors of u, u^2 and u^3

  /// V(u) of a channel.
  GART_HD GART_INLINE float gain(int channel, float u) const {
    float const* const c = k + powers * channel;
    return fma(u, fma(u, fma(u, c[2], c[1]), c[0]), 1.0f);
  }
};

/// The numbers of a camera that its falloff depends on.
struct image_circle {
  float cx = 0, cy = 0;  ///< principal point, pixels
  float scale = 0;       ///< of squared distances; 0: u is 0 everywhere

  image_circle() = default;
  /// From a camera with a principal point.
  GART_HD GART_INLINE explicit image_circle(camera const& c)
      : cx(c.cx), cy(c.cy), scale(static_cast<float>(4.0 / (1.0 * c.width * c.width + 1.0 * c.height * c.height))) {}

  /// u at the middle of pixel (x, y).
  GART_HD GART_INLINE float square(float x, float y) const {
    float const dx = x + 0.5f - cx, dy = y + 0.5f - cy;
    return fma(dx, dx, dy * dy) * scale;
  }
};

}  // namespace gart

namespace gart { inline namespace GART_ISA {

/// Whether two views count as one lens: the same model and size, and focal lengths within a tenth. Calibration for each
/// photograph gives one lens several focal lengths.
inline bool one_lens(camera const& a, camera const& b) {
  auto const near = [](float x, float y) { return !(std::fabs(x - y) > 0.1f * std::fabs(x)); };
  return a.kind == b.kind && a.width == b.width && a.height == b.height && near(a.fx, b.fx) && near(a.fy, b.fy);
}

}}  // namespace gart::GART_ISA
