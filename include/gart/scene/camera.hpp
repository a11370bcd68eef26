#pragma once
// Cameras: pinholes, with or without radial-tangential distortion (COLMAP's SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL,
// RADIAL and OPENCV). Axes are OpenCV's: x right, y down, z forward. Pixel (0, 0) is the top-left corner of the image,
// the ray of pixel (i, j) goes through (i + 0.5, j + 0.5); u = fx * x / z + cx.
//
// The distorted model is u = fx * x_d + cx with, for the undistorted (x, y) = (X/Z, Y/Z) and r2 = x*x + y*y,
//   x_d = x (1 + k1 r2 + k2 r2^2) + 2 p1 x y + p2 (r2 + 2 x x),  y_d likewise with p1 and p2 exchanged;
// a ray inverts it by Newton's method (undistort below).

#include <gart/core/macros.hpp>
#include <gart/math/glm.hpp>

#include <string>
#include <vector>

namespace gart {

struct distortion {
  float k1 = 0, k2 = 0, p1 = 0, p2 = 0;
  GART_HD bool any() const { return k1 != 0 || k2 != 0 || p1 != 0 || p2 != 0; }
};

// Trivially copyable: kernels hold one by value.
struct camera {
  int width = 0, height = 0;
  float fx = 0, fy = 0, cx = 0, cy = 0;
  distortion lens;
  mat3 rotation{1.0f};    // camera to world; columns are the camera's axes in the world
  vec3d position{0.0};    // the centre in the world, in double: everything else is relative to it
};

// Newton's method on the distortion; exact to float after a few steps for lenses that are invertible at the point.
GART_HD inline vec2 undistort(distortion const& lens, vec2 distorted) {
  vec2 p = distorted;
  for (int i = 0; i < 10; ++i) {
    float const x = p.x, y = p.y, r2 = x * x + y * y;
    float const radial = 1 + r2 * (lens.k1 + r2 * lens.k2);
    float const slope = 2 * lens.k1 + 4 * lens.k2 * r2;  // d radial / d x = slope * x
    float const ex = x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x) - distorted.x;
    float const ey = y * radial + 2 * lens.p2 * x * y + lens.p1 * (r2 + 2 * y * y) - distorted.y;
    float const xx = radial + slope * x * x + 2 * lens.p1 * y + 6 * lens.p2 * x;
    float const xy = slope * x * y + 2 * lens.p1 * x + 2 * lens.p2 * y;
    float const yy = radial + slope * y * y + 2 * lens.p2 * x + 6 * lens.p1 * y;
    float const det = xx * yy - xy * xy;
    if (!(det != 0)) break;
    vec2 const step((ex * yy - ey * xy) / det, (ey * xx - ex * xy) / det);
    p -= step;
    if (step.x * step.x + step.y * step.y < 1e-16f) break;
  }
  return p;
}

// Unit direction, in the world, of the ray through the image point (u, v).
GART_HD inline vec3 ray_direction(camera const& c, float u, float v) {
  vec2 p((u - c.cx) / c.fx, (v - c.cy) / c.fy);
  if (c.lens.any()) p = undistort(c.lens, p);
  vec3 const d = c.rotation * vec3(p.x, p.y, 1.0f);
  float const inverse = 1.0f / sqrtf(d.x * d.x + d.y * d.y + d.z * d.z);
  return d * inverse;
}

// The same camera for an image of another size: intrinsics scale per axis.
inline camera resized(camera c, int width, int height) {
  float const sx = static_cast<float>(width) / static_cast<float>(c.width);
  float const sy = static_cast<float>(height) / static_cast<float>(c.height);
  c.fx *= sx, c.cx *= sx, c.fy *= sy, c.cy *= sy;
  c.width = width, c.height = height;
  return c;
}

struct named_camera {
  std::string name;
  camera view;
};

}  // namespace gart
