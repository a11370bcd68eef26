#pragma once
// Parts of scenes for tests of light, and a picture of one on a policy.

#include <gart/light/path_tracer.hpp>

#include <support/policies.hpp>

#include <cmath>
#include <random>
#include <vector>

namespace gart_test {

using gart::u32;
using gart::vec3;
using gart::vec3d;
namespace light = gart::light;

// A parallelogram of two triangles about a point, seen counter-clockwise from cross(u, v).
inline light::mesh quad(vec3 const& middle, vec3 const& u, vec3 const& v, u32 material) {
  light::mesh m;
  m.positions = {middle - u - v, middle + u - v, middle + u + v, middle - u + v};
  m.uvs = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  m.triangles = {0, 1, 2, 0, 2, 3};
  m.triangle_material = {material, material};
  return m;
}

inline light::mesh ball(vec3 const& middle, float radius, u32 material, int rings, bool smooth) {
  light::mesh m;
  int const sectors = 2 * rings;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j <= sectors; ++j) {
      float const theta = 3.14159265f * static_cast<float>(i) / static_cast<float>(rings),
                  phi = 6.2831853f * static_cast<float>(j % sectors) / static_cast<float>(sectors);
      vec3 const n(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
      m.positions.push_back(middle + radius * n);
      if (smooth) m.normals.push_back(n);
    }
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < sectors; ++j) {
      u32 const a = static_cast<u32>(i * (sectors + 1) + j), b = a + static_cast<u32>(sectors) + 1;
      for (u32 const c : {a, a + 1, b + 1, a, b + 1, b}) m.triangles.push_back(c);
    }
  m.triangle_material.assign(m.triangles.size() / 3, material);
  return m;
}

inline light::material material_of(light::material_kind kind, vec3 const& color = vec3(1.0f)) {
  light::material m;
  m.kind = kind, m.base_color = color;
  return m;
}
// Lambert's: it reflects nothing.
inline light::material matt(vec3 const& color) {
  light::material m = material_of(light::material_kind::surface, color);
  m.ior = 1;
  return m;
}
inline light::material glowing(vec3 const& emission) {
  light::material m = matt(vec3(0.0f));
  m.emission = emission;
  return m;
}

inline light::light point_light(vec3 const& at, vec3 const& intensity) {
  light::light l;
  l.kind = light::light_kind::point, l.position = at, l.color = intensity;
  return l;
}
inline light::light sun(vec3 const& direction, vec3 const& irradiance, float angle = 0) {
  light::light l;
  l.kind = light::light_kind::directional, l.direction = direction, l.color = irradiance, l.angle = angle;
  return l;
}

inline gart::camera camera_at(vec3d const& position, int width = 24, int height = 16, float focal = 20) {
  gart::camera view;
  view.width = width, view.height = height, view.fx = view.fy = focal;
  view.cx = 0.5f * static_cast<float>(width), view.cy = 0.5f * static_cast<float>(height);
  view.position = position;
  return view;
}

// Gaussians about a point; `shown` false: black ones, which shadow and are not seen.
inline gart::gaussian_model cloud(std::uint64_t seed, std::size_t count, vec3 const& middle, float spread,
                                  bool shown = true, int sh_degree = 2) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(count, sh_degree);
  for (std::size_t i = 0; i < m.mean.size(); ++i) m.mean[i] = middle[static_cast<int>(i % 3)] + spread * normal(engine);
  for (auto& x : m.log_scale) x = std::log(0.25f * spread) + 0.6f * normal(engine);
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.opacity) x = normal(engine);
  for (auto& x : m.sh) x = shown ? 0.4f * normal(engine) : 0.0f;
  std::size_t const row = m.sh.size() / count;
  if (!shown)
    for (std::size_t i = 0; i < m.sh.size(); ++i)
      if (i % row < 3) m.sh[i] = -4;
  return m;
}

inline gart::light::path_options through_middles(int bounces = 1) {
  light::path_options o;
  o.jitter = false, o.bounces = bounces, o.shadows = light::shadow_kind::none;
  return o;
}

template <class E>
std::vector<float> picture(E& exec, gart::gaussian_model const& model, light::scene const& scene,
                           gart::camera const& view, gart::render_options const& options,
                           light::path_options const& paths, int samples = 1) {
  gart::gaussians<E> const there(exec, model);
  gart::path_tracer<E> tracer(exec);
  tracer.set_model(there.view(), model.sh_degree);
  tracer.set_scene(scene);
  tracer.begin(view, options, paths);
  tracer.add(samples);
  std::vector<float> out = tracer.sums().to_host();
  for (float& x : out) x /= static_cast<float>(samples);
  return out;
}

}  // namespace gart_test
