#pragma once
// What a camera's image sees, in slopes x / z and y / z: the rectangle about it, by sampling the image's border. Host
// side, in double.

#include <gart/scene/camera.hpp>

#include <cmath>

namespace gart {

struct seen_slopes {
  double x0 = 1e300, x1 = -1e300, y0 = 1e300, y1 = -1e300;
  double least_cosine = 1;  // of a border pixel's ray with the camera's axis
};

inline seen_slopes slopes_seen(camera const& c) {
  seen_slopes out;
  constexpr int steps = 64;
  // A loop: unrolled, a lens would take the registers of cameras without one.
  GART_NO_UNROLL
  for (int k = 0; k <= steps; ++k) {
    double const s = static_cast<double>(k) / steps;
    double const border[4][2] = {
        {s * c.width, 0}, {s * c.width, 1.0 * c.height}, {0, s * c.height}, {1.0 * c.width, s * c.height}};
    for (auto const& b : border) {
      vec2 p(static_cast<float>((b[0] - c.cx) / c.fx), static_cast<float>((b[1] - c.cy) / c.fy));
      if (c.lens.any()) p = undistort(c.lens, p);
      out.x0 = p.x < out.x0 ? p.x : out.x0, out.x1 = p.x > out.x1 ? p.x : out.x1;
      out.y0 = p.y < out.y0 ? p.y : out.y0, out.y1 = p.y > out.y1 ? p.y : out.y1;
      double const cosine = 1 / std::sqrt(1.0 + double{p.x} * p.x + double{p.y} * p.y);
      out.least_cosine = cosine < out.least_cosine ? cosine : out.least_cosine;
    }
  }
  return out;
}

}  // namespace gart
