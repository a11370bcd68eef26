#pragma once
/// \file
/// The weights of a camera's pixels in training. Pixels of the whole sphere count by their solid angle, pixels without
/// a ray not at all. Host side; a byte a pixel, in parts of 255.

#include <gart/camera/models.hpp>
#include <gart/scene/image.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

namespace detail {

// 0 to 1. Those of most cameras count alike.
template <class Model>
double pixel_weight(Model const&, float, float) {
  return 1;
}
// A row has one height on the sphere; none counts for nothing.
inline double pixel_weight(equirectangular const& model, float, float v) {
  return std::fmax(1.0 / 255, std::sin(3.141592653589793 * double{v} / model.height));
}
inline double pixel_weight(radial_lens const& model, float u, float v) { return model.sees(u, v) ? 1 : 0; }
template <class Lens>
double pixel_weight(rolling_shutter<Lens> const& model, float u, float v) {
  return pixel_weight(model.lens, u, v);
}

// Whether pixels of a model count differently.
template <class Model>
inline constexpr bool weighs_pixels = std::is_same_v<Model, equirectangular> || std::is_same_v<Model, radial_lens>;
template <class Lens>
inline constexpr bool weighs_pixels<rolling_shutter<Lens>> = weighs_pixels<Lens>;

}  // namespace detail

/// Whether pixels count differently.
inline bool has_pixel_weights(camera const& c) {
  return visit_camera(c, []<class Model>(Model const&) { return detail::weighs_pixels<Model>; });
}

/// Of each pixel, [H][W]. Cost: of a lens with tangential terms a ray a pixel.
inline image8 pixel_weights(camera const& c) {
  image8 out(c.width, c.height, 1, 255);
  visit_camera(c, [&](auto const& model) {
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        double const weight = detail::pixel_weight(model, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        out.at(x, y, 0) = static_cast<u8>(std::lround(255 * weight));
      }
  });
  return out;
}

}}  // namespace gart::GART_ISA
