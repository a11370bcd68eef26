#pragma once
/// \file
/// The pinhole: u = fx x / z + cx, v = fy y / z + cy (COLMAP's SIMPLE_PINHOLE and PINHOLE). The one model whose rays
/// kernels cast themselves, and whose tile lists are sorted by z.

#include <gart/camera/model.hpp>
#include <gart/camera/seen_slopes.hpp>
#include <gart/camera/slope_filter.hpp>

namespace gart::inline GART_ISA {

struct pinhole_bounds {
  footprint_view view;
  GART_HD footprint operator()(ellipsoid const& e) const {
    slope_box s;
    footprint out = project(view, e, s);
    if (!s.visible) return {};
    out.box = pixels_of(view, s);
    return out;
  }
};

/// The direction, in world axes, of slopes x / z and y / z. It decides hits, so its arithmetic is fixed.
template <class F>
GART_HD GART_INLINE primary_ray_of<F> ray_of_slopes(mat3 const& rotation, F x, F y) {
  vec3_of<F> d;
  for (int k = 0; k < 3; ++k) d[k] = fma(F(rotation[0][k]), x, fma(F(rotation[1][k]), y, F(rotation[2][k])));
  return unit_ray(d);
}

struct pinhole : camera_base {
  float fx = 0, fy = 0, cx = 0, cy = 0;
  mat3 rotation{1.0f};

  pinhole() = default;
  GART_HD explicit pinhole(camera const& c)
      : camera_base(c), fx(c.fx), fy(c.fy), cx(c.cx), cy(c.cy), rotation(c.rotation) {}

  template <class F>
  GART_HD GART_INLINE primary_ray_of<F> ray(F u, F v) const {
    return ray_of_slopes(rotation, divide(add(u, F(-cx)), F(fx)), divide(add(v, F(-cy)), F(fy)));
  }

  GART_HD ray_depth depth() const { return {rotation[2], 0}; }

  pinhole_bounds bounds(float near) const {
    require_near(near);
    return {view_of(near * slopes_seen(*this).least_cosine)};
  }

  slope_filter<> filter(float pixels) const { return {*this, no_lens{}, slopes_seen(*this), pixels}; }

  camera_fault fault() const {
    if (camera_fault const size = size_fault(*this); size.what) return size;
    if (!(fx > 0 && fy > 0 && is_finite(fx) && is_finite(fy)))
      return {"the focal length is not a positive number", "correct fx and fy"};
    if (!(is_finite(cx) && is_finite(cy))) return {"the principal point is not finite", "correct cx and cy"};
    return pose_fault(position, rotation);
  }

  /// least_z: of a hit.
  footprint_view view_of(double least_z) const {
    mat3d world_to_camera(1.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) world_to_camera[i][j] = rotation[j][i];
    return {world_to_camera, fx, fy, cx, cy, width, height, least_z};
  }
};

static_assert(central_camera<pinhole>);

}  // namespace gart::inline GART_ISA
