#pragma once
/// \file
/// Parallel rays: a pixel's ray begins on the plane through `position` and goes along the camera's axis,
///   u = fx x + cx,   v = fy y + cy,
/// fx and fy in pixels a world unit (nerfstudio's ORTHOPHOTO). Hits lie in front of that plane.
///
/// The box of an ellipsoid m + A s is m_x +- |A_x|, exactly. Where it crosses the plane at `near`, only the part in
/// front counts. The extreme of the section, an ellipse, takes the place of an extreme behind the plane.

#include <gart/camera/lens_slopes.hpp>
#include <gart/camera/model.hpp>

namespace gart { inline namespace GART_ISA {

/// Boxes of ellipsoids.
struct orthographic_bounds {
  mat3d to_camera;        ///< world to camera
  double fx, fy, cx, cy;  ///< pixels a world unit, principal point
  int width, height;      ///< pixels
  float near;             ///< of hits

  /// The pixels that can hit it, and its near depth; empty where none can.
  GART_HD footprint operator()(ellipsoid const& e) const {
    vec3d const m = to_camera * e.center;
    mat3d const a = to_camera * e.axes;
    vec3d const ax(a[0][0], a[1][0], a[2][0]), ay(a[0][1], a[1][1], a[2][1]), az(a[0][2], a[1][2], a[2][2]);
    double const depth = glm::length(az), reach = fabs(e.center.x) + fabs(e.center.y) + fabs(e.center.z);
    double const error = 2 * rounding_of_hits * (reach + glm::length(ax) + glm::length(ay) + depth);
    footprint out;
    if (!(m.z + depth + error > near)) return out;
    double const nearest = m.z - depth - error;
    out.depth = static_cast<float>((nearest > near ? nearest : near) * (1 - 1e-6));
    detail::interval const x = extent(m.x, ax, m.z, az, near - error), y = extent(m.y, ay, m.z, az, near - error);
    double const pad_x = fx * error + 0.01, pad_y = fy * error + 0.01;
    out.box = {detail::first_pixel(fx * x.lo + cx - pad_x, width), detail::first_pixel(fy * y.lo + cy - pad_y, height),
               detail::first_pixel(fx * x.hi + cx + pad_x, width), detail::first_pixel(fy * y.hi + cy + pad_y, height)};
    if (out.box.empty()) return {};
    return out;
  }

 private:
  // The extent in x of the part of the ellipsoid with z >= n. (mx, ax): centre and row of the axis, (mz, az): of depth.
  GART_HD static detail::interval extent(double mx, vec3d const& ax, double mz, vec3d const& az, double n) {
    double const half = glm::length(ax), zz = glm::dot(az, az), xz = glm::dot(ax, az);
    detail::interval out;
    for (int side = -1; side <= 1; side += 2) {
      double const z = half > 0 ? mz + side * xz / half : mz;
      if (z >= n) out.add(mx + side * half);
    }
    if (mz - sqrt(zz) < n && zz > 0) {
      double const e = n - mz, share = 1 - e * e / zz, across2 = half * half - xz * xz / zz;
      double const reach = share > 0 && across2 > 0 ? sqrt(share * across2) : 0.0, middle = mx + xz * e / zz;
      out.add(middle - reach), out.add(middle + reach);
    }
    return out;
  }
};

/// The filter of its pixels: as wide everywhere.
struct orthographic_filter {
  vec3d position;  ///< of the camera
  float sigma;     ///< world units

  /// The mean relative to the camera.
  GART_HD GART_INLINE vec3 from_camera(gaussian_parameters const& g) const { return relative_mean(g.mean, position); }
  /// Anywhere.
  GART_HD GART_INLINE float sigma_at(vec3 const&) const { return sigma; }
  /// It does not change with the mean.
  GART_HD GART_INLINE filter_at at(vec3 const&) const { return {sigma, vec3(0.0f)}; }
};

/// How its rays change with their image points: they keep their direction.
struct orthographic_slopes {
  mat3 rotation;  ///< camera to world
  /// Of any point.
  GART_HD ray_slopes operator()(float, float, vec3 const&) const {
    ray_slopes out;
    out.origin_x = rotation[0], out.origin_y = rotation[1];
    return out;
  }
};

/// The model.
struct orthographic : focal_base {
  bool rolls = false;  ///< a rolling shutter was asked for

  ///@{
  /// From the run-time camera.
  orthographic() = default;
  GART_HD explicit orthographic(camera const& c) : focal_base(c), rolls(c.shutter != shutter_kind::global) {}
  ///@}

  /// Through the image point (u, v), in pixels.
  GART_HD GART_INLINE gart::ray ray(float u, float v) const {
    float const x = divide(add(u, -cx), fx), y = divide(add(v, -cy), fy);
    gart::ray out;
    for (int k = 0; k < 3; ++k) out.origin[k] = fma(rotation[0][k], x, mul(rotation[1][k], y));
    out.direction = unit_ray<float>(rotation[2]).direction;
    return out;
  }

  /// How rays change with their image points.
  orthographic_slopes slopes() const { return {rotation}; }

  /// For hits at t > near.
  orthographic_bounds bounds(float near) const {
    require_near(near);
    mat3d to_camera(1.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) to_camera[i][j] = rotation[j][i];
    return {to_camera, fx, fy, cx, cy, width, height, near};
  }

  /// Of so many pixels.
  orthographic_filter filter(float pixels) const { return {position, pixels / std::sqrt(fx * fy)}; }

  /// Size, focal lengths, principal point, pose or shutter.
  camera_fault fault() const {
    if (camera_fault const image = image_fault(); image.what) return image;
    if (rolls) return {"an orthographic camera has no rolling shutter", "make its shutter GLOBAL"};
    return pose_fault(position, rotation);
  }
};

static_assert(focal_camera<orthographic> && !central_camera<orthographic>);

}}  // namespace gart::GART_ISA
