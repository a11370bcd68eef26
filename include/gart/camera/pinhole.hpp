#pragma once
/// \file
/// The pinhole: u = fx x / z + cx, v = fy y / z + cy (COLMAP's SIMPLE_PINHOLE and PINHOLE). The one model whose rays
/// kernels cast themselves, and whose tile lists are sorted by z.

#include <gart/camera/lens_slopes.hpp>
#include <gart/camera/model.hpp>
#include <gart/camera/seen_slopes.hpp>
#include <gart/camera/slope_filter.hpp>

namespace gart { inline namespace GART_ISA {

/// Boxes of ellipsoids, perspective-correct.
struct pinhole_bounds {
  footprint_view view;  ///< the camera, in double
  /// The pixels that can hit it, and its near depth; empty where none can.
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

/// A camera without a lens.
struct pinhole : focal_base {
  ///@{
  /// From the run-time camera.
  pinhole() = default;
  GART_HD explicit pinhole(camera const& c) : focal_base(c) {}
  ///@}

  /// Through the image point (u, v), in pixels.
  template <class F>
  GART_HD GART_INLINE primary_ray_of<F> ray(F u, F v) const {
    return ray_of_slopes(rotation, divide(add(u, F(-cx)), F(fx)), divide(add(v, F(-cy)), F(fy)));
  }

  /// How rays change with their image points.
  lens_slopes slopes() const { return {camera_kind::perspective, {}, rotation}; }

  /// z: along the camera's axis.
  GART_HD ray_depth depth() const { return {rotation[2], 0}; }

  /// For hits at t > near.
  pinhole_bounds bounds(float near) const {
    require_near(near);
    return {view_of(near * slopes_seen(*this).least_cosine)};
  }

  /// Of so many pixels.
  slope_filter<> filter(float pixels) const { return {*this, no_lens{}, slopes_seen(*this), pixels}; }

  /// Size, focal lengths, principal point or pose.
  camera_fault fault() const {
    if (camera_fault const image = image_fault(); image.what) return image;
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

static_assert(central_camera<pinhole> && focal_camera<pinhole>);

}}  // namespace gart::GART_ISA
