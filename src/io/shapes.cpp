// Meshes that need no file.

#include "scene_parts.hpp"

#include <cmath>
#include <numbers>

namespace gart::io {
namespace {

bool apart(raw_mesh const& m, u32 a, u32 b) {
  vec3d const d = m.position[a] - m.position[b];
  return glm::dot(d, d) > 1e-20;
}

// point(u, v) over [0, 1]^2, with its normal; borders are there twice, for the uvs.
template <class F>
raw_mesh grid(u32 across, u32 down, F const& point) {
  raw_mesh m;
  for (u32 j = 0; j <= down; ++j)
    for (u32 i = 0; i <= across; ++i) {
      double const u = static_cast<double>(i) / across, v = static_cast<double>(j) / down;
      auto const [p, n] = point(u, v);
      m.position.push_back(p), m.normal.push_back(vec3(n));
      m.uv.push_back({static_cast<float>(u), static_cast<float>(v)});
    }
  for (u32 j = 0; j < down; ++j)
    for (u32 i = 0; i < across; ++i) {
      u32 const a = j * (across + 1) + i, b = a + across + 1;
      if (apart(m, a, a + 1)) m.triangle.push_back({a, b, a + 1});  // else it is a pole, where the triangle is none
      if (apart(m, b, b + 1)) m.triangle.push_back({a + 1, b, b + 1});
    }
  m.material.assign(m.triangle.size(), 0);
  return m;
}

struct point_and_normal {
  vec3d p, n;
};

constexpr double turn = 2 * std::numbers::pi;

point_and_normal of_sphere(double u, double v) {
  double const out = std::sin(turn / 2 * v), y = std::cos(turn / 2 * v);
  vec3d const p(out * std::sin(turn * u), y, out * std::cos(turn * u));
  return {p, p};
}

point_and_normal of_torus(double u, double v) {
  constexpr double ring = 0.7, tube = 0.3;
  vec3d const out(std::sin(turn * u), 0, std::cos(turn * u)), up(0, 1, 0);
  vec3d const n = std::cos(turn * v) * out - std::sin(turn * v) * up;
  return {ring * out + tube * n, n};
}

// From the middle of a face: its normal, its axes of u and v.
void add_face(raw_mesh& m, vec3d const& normal, vec3d const& u, vec3d const& v, vec3d const& middle) {
  auto const first = static_cast<u32>(m.position.size());
  for (int k = 0; k < 4; ++k) {
    double const s = k % 2 ? 1 : -1, t = k / 2 ? 1 : -1;
    m.position.push_back(middle + s * u + t * v), m.normal.push_back(vec3(normal));
    m.uv.push_back({static_cast<float>(k % 2), static_cast<float>(k / 2)});
  }
  m.triangle.push_back({first, first + 2, first + 1}), m.triangle.push_back({first + 1, first + 2, first + 3});
  m.material.resize(m.triangle.size(), 0);
}

}  // namespace

raw_mesh shape_named(std::string_view name) {
  if (name == "sphere") return grid(128, 64, of_sphere);
  if (name == "torus") return grid(128, 64, of_torus);
  raw_mesh m;
  vec3d const x(1, 0, 0), y(0, 1, 0), z(0, 0, 1);
  if (name == "plane") {
    add_face(m, y, x, z, vec3d(0.0));
    return m;
  }
  // v goes down on the sides.
  for (auto const& [normal, u] : {std::pair{z, x}, {-z, -x}, {x, -z}, {-x, z}}) add_face(m, normal, u, -y, normal);
  add_face(m, y, x, z, y), add_face(m, -y, x, -z, -y);
  return m;
}

mat3d turn_from_y(vec3d const& up) {
  vec3d const b = up / glm::length(up);
  mat3d m(1.0);
  if (b.y < -1 + 1e-12) {
    m[0].x = m[1].y = -1;
    return m;
  }
  // 1 + [v] + [v]^2 / (1 + c) of v = y x b, c = y . b.
  double const s = 1 / (1 + b.y);
  m[0] = vec3d(1 - b.x * b.x * s, -b.x, -b.x * b.z * s);
  m[1] = b;
  m[2] = vec3d(-b.x * b.z * s, -b.z, 1 - b.z * b.z * s);
  return m;
}

}  // namespace gart::io
