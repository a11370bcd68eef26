#pragma once
/// \file
/// The whole sphere (COLMAP's and nerfstudio's EQUIRECTANGULAR). The width shows the azimuth, from behind over the
/// right of the middle column to behind again. The height shows the angle from straight up (-y) down:
///   direction = (sin(phi) sin(theta), -cos(theta), cos(phi) sin(theta)),   phi = 2 pi (u / W - 1/2), theta = pi v / H.
///
/// Boxes are exact in azimuth and all but exact in height (camera/seen_angles.hpp). A box that crosses the seam at the
/// left and right border goes on past the width (footprint::seam). A box that holds a pole has all columns. Half a turn
/// of the camera about its y axis rolls the image by half its width. Where the width is even, it does so bit by bit.

#include <gart/camera/radial_lens.hpp>

namespace gart { inline namespace GART_ISA {

/// Boxes of ellipsoids on the sphere.
struct equirectangular_bounds {
  mat3d to_polar;     ///< world to camera, the pole in place of z: x is forward, y right, z up
  int width, height;  ///< pixels
  float near;         ///< of hits

  /// The pixels that can hit it, and its near depth; empty where none can.
  GART_HD footprint operator()(ellipsoid const& e) const {
    constexpr double pi = 3.141592653589793, pad = 0.01;
    seen_ellipsoid const s(to_polar, e);
    footprint out;
    out.depth = least_distance(e, near);
    axial_range const range = angles_about_z(s, out.depth);
    double const down = height / pi, round = width / (2 * pi);
    out.box.y0 = detail::first_pixel(down * range.lo - pad, height);
    out.box.y1 = detail::first_pixel(down * range.hi + pad, height);
    if (out.box.y1 <= out.box.y0) return {};
    double const first = ceil((range.middle - range.half + pi) * round - pad - 0.5),
                 end = ceil((range.middle + range.half + pi) * round + pad - 0.5);
    if (end <= first) return {};
    if (!(end - first + footprint::seam_room <= width)) {
      out.box.x1 = static_cast<u16>(width);
      return out;
    }
    int const turns = static_cast<int>(floor(first / width));
    int const x0 = static_cast<int>(first) - turns * width, x1 = static_cast<int>(end) - turns * width;
    out.box.x0 = static_cast<u16>(x0), out.box.x1 = static_cast<u16>(x1);
    if (x1 > width) out.seam = static_cast<u16>(width);
    return out;
  }
};

/// The model.
struct equirectangular : camera_base {
  mat3 rotation{1.0f};  ///< camera to world; columns are the camera's axes

  ///@{
  /// From the run-time camera.
  equirectangular() = default;
  GART_HD explicit equirectangular(camera const& c) : camera_base(c), rotation(c.rotation) {}
  ///@}

  /// Through the image point (u, v), in pixels.
  template <class F>
  GART_HD GART_INLINE primary_ray_of<F> ray(F u, F v) const {
    return each_lane(u, v, [this](float one_u, float one_v) { return direction_of(one_u, one_v); });
  }
  /// The same, of one point.
  GART_HD vec3 direction_of(float u, float v) const {
    fixed_direction const d = direction_in_camera(u, v);
    return unit_in_world(rotation, d.x, d.y, d.z);
  }
  /// In the camera's axes.
  GART_HD fixed_direction direction_in_camera(float u, float v) const {
    sine_cosine const round = sine_cosine_of_quarters(4 * static_cast<double>(u) - 2.0 * width, width);
    sine_cosine const down = sine_cosine_of_quarters(2 * static_cast<double>(v), height);
    return {round.sine * down.sine, -down.cosine, round.cosine * down.sine, true};
  }

  /// For hits at t > near.
  equirectangular_bounds bounds(float near) const {
    require_near(near);
    mat3d to_polar(1.0);
    for (int j = 0; j < 3; ++j)
      to_polar[j][0] = rotation[2][j], to_polar[j][1] = rotation[0][j], to_polar[j][2] = -rotation[1][j];
    return {to_polar, width, height, near};
  }

  /// Of so many pixels; that of the last row at the poles.
  axial_filter filter(float pixels) const {
    double const pi = 3.141592653589793, pixel = 2 * pi / width * (pi / height), least = std::sin(0.5 * pi / height);
    return {position, -rotation[1], pixels, pi, [=](double theta) {
              double const sine = std::sin(theta);
              return pixel * (sine > least ? sine : least);
            }};
  }

  /// Size or pose.
  camera_fault fault() const {
    if (camera_fault const size = size_fault(*this); size.what) return size;
    if (width > 32767) return {"the image of the sphere is wider than 32767 pixels", "shrink it"};
    return pose_fault(position, rotation);
  }
};

static_assert(central_camera<equirectangular>);

}}  // namespace gart::GART_ISA
