#pragma once
// A camera without a centre: parallel rays, one a pixel of `size` world units, from the plane through `position`. The
// least of a model whose rays have origins.

#include <gart/camera/model.hpp>

namespace gart_test {

struct toy_orthographic_bounds {
  gart::mat3d to_camera;
  double pixel;
  int width, height;
  float near;

  GART_HD gart::footprint operator()(gart::ellipsoid const& e) const {
    gart::vec3d const m = to_camera * e.center;
    double half[3];
    for (int k = 0; k < 3; ++k) {
      double sum = 0;
      for (int j = 0; j < 3; ++j) {
        gart::vec3d const a = to_camera * e.axes[j];
        sum += a[k] * a[k];
      }
      half[k] = sqrt(sum);
    }
    double const reach = sqrt(m.x * m.x + m.y * m.y + m.z * m.z) + half[0] + half[1] + half[2];
    double const error = gart::rounding_of_hits * (reach + pixel * (width + height));
    gart::footprint out;
    if (!(m.z + half[2] + error > near)) return out;
    double const nearest = m.z - half[2] - error;
    out.depth = static_cast<float>((nearest > near ? nearest : near) * (1 - 1e-6));
    double const x = m.x / pixel + 0.5 * width, y = m.y / pixel + 0.5 * height;
    double const w = (half[0] + error) / pixel + 0.01, h = (half[1] + error) / pixel + 0.01;
    out.box = {gart::detail::first_pixel(x - w, width), gart::detail::first_pixel(y - h, height),
               gart::detail::first_pixel(x + w, width), gart::detail::first_pixel(y + h, height)};
    if (out.box.empty()) out.box = {};
    return out;
  }
};

struct toy_orthographic_filter {
  gart::vec3d position;
  float width;  // of so many pixels, everywhere the same
  GART_HD gart::vec3 from_camera(gart::gaussian_parameters const& g) const {
    return gart::relative_mean(g.mean, position);
  }
  GART_HD float sigma_at(gart::vec3 const&) const { return width; }
  GART_HD gart::filter_at at(gart::vec3 const&) const { return {width, gart::vec3(0.0f)}; }
};

struct toy_orthographic : gart::camera_base {
  float pixel = 1;
  gart::mat3 rotation{1.0f};

  toy_orthographic() = default;
  toy_orthographic(gart::camera const& c, float size) : camera_base(c), pixel(size), rotation(c.rotation) {}

  GART_HD gart::ray ray(float u, float v) const {
    float const x = (u - 0.5f * static_cast<float>(width)) * pixel, y = (v - 0.5f * static_cast<float>(height)) * pixel;
    return {rotation[0] * x + rotation[1] * y, gart::unit_ray(rotation[2]).direction};
  }
  toy_orthographic_bounds bounds(float near) const {
    gart::mat3d to_camera(1.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) to_camera[i][j] = rotation[j][i];
    return {to_camera, pixel, width, height, near};
  }
  toy_orthographic_filter filter(float pixels) const { return {position, pixels * pixel}; }
  gart::camera_fault fault() const {
    if (!(pixel > 0)) return {"the pixels have no size", "correct it"};
    return gart::size_fault(*this);
  }
};

static_assert(gart::camera_model<toy_orthographic> && !gart::central_camera<toy_orthographic>);

}  // namespace gart_test
