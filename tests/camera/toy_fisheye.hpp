#pragma once
// A camera that gart does not have: an equidistant fisheye, r = f theta, of more than half a sphere. Its boxes are
// plain and wide. It is here to show what a model is, and that one header is enough.

#include <gart/camera/model.hpp>

namespace gart_test {

struct toy_fisheye_bounds {
  gart::mat3d to_camera;
  double f, cx, cy;
  int width, height;
  float near;

  GART_HD gart::footprint operator()(gart::ellipsoid const& e) const {
    gart::footprint out;
    gart::vec3d const m = to_camera * e.center;
    double reach2 = 0;
    for (int k = 0; k < 3; ++k) {
      gart::vec3d const& a = e.axes[k];
      reach2 += a.x * a.x + a.y * a.y + a.z * a.z;
    }
    double const distance = sqrt(m.x * m.x + m.y * m.y + m.z * m.z);
    double const reach = sqrt(reach2) + 1e-5 * (distance + sqrt(reach2));  // a sphere about it, and what float loses
    out.depth = gart::least_distance(e, near);
    out.box = {0, 0, static_cast<gart::u16>(width), static_cast<gart::u16>(height)};
    if (!(reach < distance)) return out;
    // All directions within `cap` of the middle's; on the image they lie no farther from it than the map stretches.
    double const across = sqrt(m.x * m.x + m.y * m.y), theta = atan2(across, m.z), cap = asin(reach / distance);
    double const last = theta + cap;
    if (last > 3.0) return out;
    double const stretch = last > 1e-3 ? last / sin(last) : 1, r = f * stretch * cap + 0.5;
    double const u = cx + (across > 0 ? f * theta * m.x / across : 0),
                 v = cy + (across > 0 ? f * theta * m.y / across : 0);
    out.box = {gart::detail::first_pixel(u - r, width), gart::detail::first_pixel(v - r, height),
               gart::detail::first_pixel(u + r, width), gart::detail::first_pixel(v + r, height)};
    if (out.box.empty()) out.box = {};
    return out;
  }
};

struct toy_fisheye_filter {
  gart::vec3d position;
  gart::vec3 forward;
  float angle;  // of so many pixels on the axis

  GART_HD gart::vec3 from_camera(gart::gaussian_parameters const& g) const {
    return gart::relative_mean(g.mean, position);
  }
  // A pixel's solid angle is sin(theta) / theta of that on the axis.
  GART_HD float sigma_at(gart::vec3 const& m) const { return at(m).sigma; }
  GART_HD gart::filter_at at(gart::vec3 const& m) const {
    float const z = m.x * forward.x + m.y * forward.y + m.z * forward.z, square = m.x * m.x + m.y * m.y + m.z * m.z;
    gart::vec3 const side = m - z * forward;
    float const across = sqrtf(side.x * side.x + side.y * side.y + side.z * side.z), theta = atan2f(across, z);
    if (!(theta > 1e-3f && theta < 3)) return {angle * sqrtf(square), square > 0 ? m / square : gart::vec3(0.0f)};
    float const narrow = sinf(theta) / theta;
    gart::vec3 const theta_by_m = (side * (z / across) - forward * across) / square;
    return {angle * sqrtf(narrow * square), m / square + theta_by_m * (0.5f * (cosf(theta) / sinf(theta) - 1 / theta))};
  }
};

struct toy_fisheye : gart::camera_base {
  float f = 0, cx = 0, cy = 0;
  gart::mat3 rotation{1.0f};

  toy_fisheye() = default;
  explicit toy_fisheye(gart::camera const& c) : camera_base(c), f(c.fx), cx(c.cx), cy(c.cy), rotation(c.rotation) {}

  template <class F>
  GART_HD gart::primary_ray_of<F> ray(F u, F v) const {
    return gart::each_lane(u, v, [this](float u, float v) {
      float const x = u - cx, y = v - cy, r = sqrtf(x * x + y * y), theta = r / f;
      float const side = r > 0 ? sinf(theta) / r : 0.0f;
      return gart::unit_ray(rotation * gart::vec3(side * x, side * y, cosf(theta))).direction;
    });
  }
  toy_fisheye_bounds bounds(float near) const {
    gart::mat3d to_camera(1.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) to_camera[i][j] = rotation[j][i];
    return {to_camera, f, cx, cy, width, height, near};
  }
  toy_fisheye_filter filter(float pixels) const { return {position, rotation[2], pixels / f}; }
  gart::camera_fault fault() const {
    if (!(f > 0)) return {"the focal length is not a positive number", "correct fx"};
    return gart::size_fault(*this);
  }
  bool one_to_one() const { return std::hypot(std::fmax(cx, width - cx), std::fmax(cy, height - cy)) < 3.14159f * f; }
};

static_assert(gart::central_camera<toy_fisheye>);

}  // namespace gart_test
