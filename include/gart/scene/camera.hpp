#pragma once
// Cameras: pinholes, with or without radial-tangential distortion (COLMAP's SIMPLE_PINHOLE, PINHOLE, SIMPLE_RADIAL,
// RADIAL and OPENCV). Axes are OpenCV's: x right, y down, z forward. Pixel (0, 0) is the top-left corner of the image,
// the ray of pixel (i, j) goes through (i + 0.5, j + 0.5); u = fx * x / z + cx.
//
// The distorted model is u = fx * x_d + cx with, for the undistorted (x, y) = (X/Z, Y/Z) and r2 = x*x + y*y,
//   x_d = x (1 + k1 r2 + k2 r2^2) + 2 p1 x y + p2 (r2 + 2 x x),  y_d likewise with p1 and p2 exchanged;
// a ray inverts it by Newton's method (undistort below).
//
// Errors: require_camera throws invalid_argument for what no ray can be cast by; everything that renders calls it.

#include <gart/core/error.hpp>
#include <gart/core/macros.hpp>
#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>
#include <gart/math/lanes.hpp>

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
  mat3 rotation{1.0f};  // camera to world; columns are the camera's axes in the world
  vec3d position{0.0};  // the centre in the world, in double: everything else is relative to it
};

struct named_camera {
  std::string name;
  camera view;
};

// What is wrong with a camera, and what to correct; null where nothing is.
struct camera_fault {
  char const* what = nullptr;
  char const* remedy = nullptr;
};

}  // namespace gart

namespace gart::inline GART_ISA {

// The image point, in units of the focal length about the principal point, of the slopes x = X/Z and y = Y/Z.
GART_HD inline void distort(distortion const& lens, double x, double y, double& u, double& v) {
  double const r2 = x * x + y * y, radial = 1 + r2 * (lens.k1 + r2 * lens.k2);
  u = x * radial + 2 * lens.p1 * x * y + lens.p2 * (r2 + 2 * x * x);
  v = y * radial + 2 * lens.p2 * x * y + lens.p1 * (r2 + 2 * y * y);
}

inline camera_fault fault_of(camera const& c) {
  auto const finite = [](auto const&... v) { return (is_finite(static_cast<float>(v)) && ...); };
  if (c.width < 1 || c.height < 1) return {"the image size is not positive", "correct the width and height"};
  // Boxes count pixels in 16 bits, launches in 32, padded to blocks of 8 x 4.
  if (c.width > 65535 || c.height > 65535 || (u64(c.width) + 7) / 8 * 8 * ((u64(c.height) + 3) / 4 * 4) > 0xffffffffu)
    return {"the image is larger than 65535 pixels a side or 2^32 in all",
            "render it in parts, or raise dataset_options.downscale"};
  if (!(c.fx > 0 && c.fy > 0 && finite(c.fx, c.fy)))
    return {"the focal length is not a positive number", "correct fx and fy"};
  if (!finite(c.cx, c.cy)) return {"the principal point is not finite", "correct cx and cy"};
  if (!finite(c.lens.k1, c.lens.k2, c.lens.p1, c.lens.p2))
    return {"the lens distortion is not finite", "correct k1, k2, p1 and p2"};
  for (int k = 0; k < 3; ++k)
    if (!finite(c.position[k], c.rotation[k][0], c.rotation[k][1], c.rotation[k][2]))
      return {"the pose is not finite", "correct the position and the rotation"};
  return {};
}

inline void require_camera(camera const& c) {
  if (camera_fault const fault = fault_of(c); fault.what)
    throw invalid_argument(std::string("camera: ") + fault.what + " (" + fault.remedy + ")");
}

// Newton's method on the distortion; exact to float after a few steps for lenses that are invertible at the point. F:
// of one point, or of one a lane.
template <class F>
GART_HD GART_INLINE void undistort(distortion const& lens, F u, F v, F& x, F& y) {
  F const k1 = lens.k1, k2 = lens.k2, lens_p1 = lens.p1, lens_p2 = lens.p2;
  F const p1 = mul(F(2.0f), lens_p1), p2 = mul(F(2.0f), lens_p2);
  x = u, y = v;
  auto going = F(0.0f) <= F(0.0f);
  for (int i = 0; i < 10; ++i) {
    F const xx = mul(x, x), yy = mul(y, y), xy = mul(x, y), r2 = add(xx, yy);
    F const radial = fma(r2, fma(r2, k2, k1), F(1.0f));
    F const slope = fma(mul(F(4.0f), k2), r2, mul(F(2.0f), k1));  // d radial / d x = slope * x
    F const ex = add(fma(x, radial, fma(p1, xy, mul(lens_p2, fma(F(2.0f), xx, r2)))), -u);
    F const ey = add(fma(y, radial, fma(p2, xy, mul(lens_p1, fma(F(2.0f), yy, r2)))), -v);
    F const by_xx = fma(slope, xx, fma(p1, y, fma(mul(F(3.0f), p2), x, radial)));
    F const by_xy = fma(slope, xy, fma(p1, x, mul(p2, y)));
    F const by_yy = fma(slope, yy, fma(p2, x, fma(mul(F(3.0f), p1), y, radial)));
    F const det = fma(by_xx, by_yy, -mul(by_xy, by_xy));
    // Where the lens folds there is nowhere to go.
    auto const folds = det == F(0.0f);
    F const dx = select(folds, F(0.0f), divide(fma(ex, by_yy, -mul(ey, by_xy)), det));
    F const dy = select(folds, F(0.0f), divide(fma(ey, by_xx, -mul(ex, by_xy)), det));
    x = select(going, add(x, -dx), x), y = select(going, add(y, -dy), y);
    // The next step would be of the order of this one's square.
    going = both(going, fma(dx, dx, mul(dy, dy)) >= F(1e-10f));
    if (!any(going)) break;
  }
}

GART_HD inline vec2 undistort(distortion const& lens, vec2 distorted) {
  vec2 p;
  undistort(lens, distorted.x, distorted.y, p.x, p.y);
  return p;
}

// Unit direction, in the world, of the ray through the image point (u, v), or of one a lane. It decides hits, so its
// arithmetic is fixed.
template <class F>
GART_HD GART_INLINE vec3_of<F> ray_directions(camera const& c, F u, F v) {
  F x = divide(add(u, F(-c.cx)), F(c.fx)), y = divide(add(v, F(-c.cy)), F(c.fy));
  if (c.lens.any()) undistort(c.lens, F(x), F(y), x, y);
  vec3_of<F> d;
  for (int k = 0; k < 3; ++k) d[k] = fma(F(c.rotation[0][k]), x, fma(F(c.rotation[1][k]), y, F(c.rotation[2][k])));
  F const inverse = divide(F(1.0f), square_root(fma(d.x, d.x, fma(d.y, d.y, mul(d.z, d.z)))));
  return {mul(d.x, inverse), mul(d.y, inverse), mul(d.z, inverse)};
}

GART_HD inline vec3 ray_direction(camera const& c, float u, float v) { return ray_directions(c, u, v); }

// The same camera for an image of another size: intrinsics scale per axis.
inline camera resized(camera c, int width, int height) {
  float const sx = static_cast<float>(width) / static_cast<float>(c.width);
  float const sy = static_cast<float>(height) / static_cast<float>(c.height);
  c.fx *= sx, c.cx *= sx, c.fy *= sy, c.cy *= sy;
  c.width = width, c.height = height;
  return c;
}

}  // namespace gart::inline GART_ISA
