#pragma once
/// \file
/// A camera whose lens is a curve of the angle with its axis (camera/lens_curve.hpp), with tangential and thin prism
/// terms. These are fisheyes, FOV, EUCM, the division models and FULL_OPENCV. Its view may pass 180 degrees.
///
/// The lens gives some pixels no ray. They lie outside its image circle, or where the distance from the axis no longer
/// grows with the angle. Their direction is zero. Such a ray hits nothing, shows the background and has no weight in
/// training (camera/pixel_weights.hpp). Rays are worked out in double of fixed rounding: the same bits everywhere.

#include <gart/camera/axial_filter.hpp>
#include <gart/camera/lens_bounds.hpp>
#include <gart/camera/lens_slopes.hpp>
#include <gart/camera/model.hpp>

#include <vector>

namespace gart { inline namespace GART_ISA {

/// A direction in a camera's axes, of any length.
struct fixed_direction {
  fixed_double x, y, z;  ///< in double of fixed rounding
  bool seen = false;     ///< false: there is none
};

/// A direction in a camera's axes, of any length, in the world's and a unit.
GART_HD inline vec3 unit_in_world(mat3 const& rotation, fixed_double x, fixed_double y, fixed_double z) {
  fixed_double d[3];
  for (int k = 0; k < 3; ++k)
    d[k] = fixed_double(rotation[0][k]) * x + fixed_double(rotation[1][k]) * y + fixed_double(rotation[2][k]) * z;
  fixed_double const length = square_root(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
  return {static_cast<float>(d[0] / length), static_cast<float>(d[1] / length), static_cast<float>(d[2] / length)};
}

/// The model.
struct radial_lens : focal_base {
  camera_kind kind{};             ///< which curve
  distortion lens;                ///< its parameters
  lens_curve curve;               ///< what they make
  double most_q = 0, most_r = 0;  ///< where rays end

  radial_lens() = default;
  /// From the run-time camera. Host side.
  explicit radial_lens(camera const& c) : focal_base(c), kind(c.kind), lens(c.lens), curve(c.kind, c.lens) {
    if (fault().what) return;
    lens_bounds const seen = whole();
    most_q = seen.farthest_q(), most_r = seen.farthest_r();
  }

  /// Through the image point (u, v), in pixels; zeros where the lens gives none.
  template <class F>
  GART_HD GART_INLINE primary_ray_of<F> ray(F u, F v) const {
    return each_lane(u, v, [this](float one_u, float one_v) { return direction_of(one_u, one_v); });
  }
  /// The same, of one point.
  GART_HD vec3 direction_of(float u, float v) const {
    fixed_direction const d = direction_in_camera(u, v);
    return d.seen ? unit_in_world(rotation, d.x, d.y, d.z) : vec3(0.0f);
  }
  /// In the camera's axes.
  GART_HD fixed_direction direction_in_camera(float u, float v) const {
    using number = fixed_double;
    number x, y;
    if (!curve.undistorted((number(u) - number(cx)) / number(fx), (number(v) - number(cy)) / number(fy), most_q, most_r,
                           x, y))
      return {};
    number const q = square_root(x * x + y * y);
    meridian_direction<number> const d = curve.back(q);
    number const share = q > 0.0 ? d.sine / q : number(0.0);
    return {share * x, share * y, d.cosine, true};
  }

  /// Whether the image point has a ray.
  bool sees(float u, float v) const {
    if (curve.beside()) return direction_of(u, v) != vec3(0.0f);
    return std::hypot((double{u} - cx) / fx, (double{v} - cy) / fy) <= most_r;
  }

  /// How rays change with their image points.
  lens_slopes slopes() const { return {kind, lens, rotation}; }

  /// For hits at t > near.
  lens_bounds bounds(float near) const {
    require_near(near);
    return whole().seen_from(rotation, near);
  }

  /// Of so many pixels: of the lens without its tangential terms.
  axial_filter filter(float pixels) const {
    lens_bounds const seen = whole();
    return {position, rotation[2], pixels, seen.last(), [&](double theta) {
              theta = theta > 1e-4 ? theta : 1e-4;
              double r, slope;
              seen.distance_at(theta, r, slope);
              return std::sin(theta) / (double{fx} * fy * r * (slope > 1e-3 ? slope : 1e-3));
            }};
  }

  /// Size, focal lengths, principal point, pose or a parameter of the lens.
  camera_fault fault() const {
    if (camera_fault const image = image_fault(); image.what) return image;
    for (float const k : {lens.k1, lens.k2, lens.k3, lens.k4, lens.k5, lens.k6, lens.p1, lens.p2, lens.d1, lens.d2,
                          lens.d3, lens.s1, lens.s2, lens.s3, lens.s4})
      if (!is_finite(k))
        return {"the lens distortion is not finite", "correct k1 to k6, p1, p2 and what else there is"};
    if (kind == camera_kind::fov && !(lens.omega > 0 && lens.omega < 3.1415926f))
      return {"the lens' omega is not an angle between 0 and pi", "correct omega"};
    if (kind == camera_kind::eucm && !(lens.alpha >= 0 && lens.alpha <= 1))
      return {"the lens' alpha is not between 0 and 1", "correct alpha"};
    if (kind == camera_kind::eucm && !(lens.beta > 0 && is_finite(lens.beta)))
      return {"the lens' beta is not a positive number", "correct beta"};
    return pose_fault(position, rotation);
  }

  /// Whether neighbours stay neighbours over the pixels that have rays, and these are a quarter of the image or more.
  bool one_to_one() const {
    lens_bounds const seen = whole();
    constexpr int steps = 48;
    std::vector<vec3d> directions;
    int given = 0;
    mat3 const upright(1.0f);
    for (int j = 0; j <= steps; ++j)
      for (int i = 0; i <= steps; ++i) {
        radial_lens own = *this;
        own.rotation = upright;
        float const u = static_cast<float>(i * width) / steps, v = static_cast<float>(j * height) / steps;
        vec3d const d(own.direction_of(u, v));
        directions.push_back(d);
        if (d == vec3d(0.0)) continue;
        ++given;
        double back_u, back_v;
        seen.image_of(d, back_u, back_v);
        if (!(std::abs(back_u - u) < 0.1 && std::abs(back_v - v) < 0.1)) return false;
      }
    if (4 * given < steps * steps) return false;
    if (!curve.beside()) return true;
    auto const at = [&](int i, int j) { return directions[static_cast<std::size_t>(j * (steps + 1) + i)]; };
    for (int j = 0; j < steps; ++j)
      for (int i = 0; i < steps; ++i) {
        vec3d const a = at(i, j), b = at(i + 1, j), c = at(i, j + 1);
        if (a == vec3d(0.0) || b == vec3d(0.0) || c == vec3d(0.0)) continue;
        vec3d const x = b - a, y = c - a;
        vec3d const n(x.y * y.z - x.z * y.y, x.z * y.x - x.x * y.z, x.x * y.y - x.y * y.x);
        if (!(n.x * a.x + n.y * a.y + n.z * a.z > 0)) return false;
      }
    return true;
  }

 private:
  lens_bounds whole() const { return tabulated_bounds(kind, lens, fx, fy, cx, cy, width, height); }
};

static_assert(central_camera<radial_lens> && focal_camera<radial_lens>);

}}  // namespace gart::GART_ISA
