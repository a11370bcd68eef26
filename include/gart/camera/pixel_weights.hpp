#pragma once
/// \file
/// What a camera's pixels count for in a training: those of the whole sphere by their solid angle, those of a lens that
/// have no ray nothing. Host side; a byte a pixel, in parts of 255.

#include <gart/camera/models.hpp>
#include <gart/scene/image.hpp>

#include <cmath>

namespace gart::inline GART_ISA {

/// Whether pixels count differently.
inline bool has_pixel_weights(camera const& c) {
  return visit_camera(c, []<class Model>(Model const&) {
    return std::is_same_v<Model, equirectangular> || std::is_same_v<Model, radial_lens>;
  });
}

/// Of each pixel, [H][W]. Cost: of a lens with tangential terms a ray a pixel.
inline image8 pixel_weights(camera const& c) {
  image8 out(c.width, c.height, 1, 255);
  visit_camera(c, [&]<class Model>(Model const& model) {
    if constexpr (std::is_same_v<Model, equirectangular> || std::is_same_v<Model, radial_lens>)
      for (int y = 0; y < c.height; ++y) {
        float const v = static_cast<float>(y) + 0.5f;
        // A row has one height on the sphere; none counts for nothing.
        double const row = std::sin(3.141592653589793 * double{v} / c.height);
        u8 const weight = static_cast<u8>(std::fmax(1.0, std::round(255 * row)));
        for (int x = 0; x < c.width; ++x) {
          if constexpr (std::is_same_v<Model, equirectangular>)
            out.at(x, y, 0) = weight;
          else if (!model.sees(static_cast<float>(x) + 0.5f, v))
            out.at(x, y, 0) = 0;
        }
      }
  });
  return out;
}

}  // namespace gart::inline GART_ISA
