#pragma once
/// \file
/// The rectangle of slopes x / z and y / z that a camera's image sees, from samples of the image's border. For models
/// that project slopes to the image. Host side, in double.

#include <gart/core/isa.hpp>
#include <gart/math/glm.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// The rectangle.
struct seen_slopes {
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;  ///< least and largest slopes
  double least_cosine = 1;                                  ///< of a border pixel's ray with the camera's axis
};

/// View: size, focal lengths and principal point. slopes_of: from an image point, in units of the focal length about
/// the principal point.
template <class View, class F>
seen_slopes slopes_seen(View const& c, F const& slopes_of) {
  seen_slopes out;
  constexpr int steps = 64;
  for (int k = 0; k <= steps; ++k) {
    double const s = static_cast<double>(k) / steps;
    double const border[4][2] = {
        {s * c.width, 0}, {s * c.width, 1.0 * c.height}, {0, s * c.height}, {1.0 * c.width, s * c.height}};
    for (auto const& b : border) {
      vec2 const p =
          slopes_of(vec2(static_cast<float>((b[0] - c.cx) / c.fx), static_cast<float>((b[1] - c.cy) / c.fy)));
      out.x0 = p.x < out.x0 ? p.x : out.x0, out.x1 = p.x > out.x1 ? p.x : out.x1;
      out.y0 = p.y < out.y0 ? p.y : out.y0, out.y1 = p.y > out.y1 ? p.y : out.y1;
      double const cosine = 1 / std::sqrt(1.0 + double{p.x} * p.x + double{p.y} * p.y);
      out.least_cosine = cosine < out.least_cosine ? cosine : out.least_cosine;
    }
  }
  return out;
}

/// Without a lens.
template <class View>
seen_slopes slopes_seen(View const& c) {
  return slopes_seen(c, [](vec2 const& p) { return p; });
}

}}  // namespace gart::GART_ISA
