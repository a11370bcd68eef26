#pragma once
// Parts of a mesh that hang together, and samples of its surface.

#include <gart/io/mesh_file.hpp>

#include <cmath>
#include <numeric>
#include <vector>

namespace gart_cli {

// Without the connected parts of fewer than `least` triangles, and the vertices that no triangle has.
inline gart::triangle_mesh large_parts(gart::triangle_mesh const& mesh, std::size_t least) {
  std::vector<gart::u32> part(mesh.position.size());
  std::iota(part.begin(), part.end(), 0u);
  auto const root = [&](gart::u32 v) {
    while (part[v] != v) v = part[v] = part[part[v]];
    return v;
  };
  for (auto const& t : mesh.triangle)
    for (int k = 1; k < 3; ++k) part[root(t[static_cast<std::size_t>(k)])] = root(t[0]);
  std::vector<std::size_t> triangles(mesh.position.size(), 0);
  for (auto const& t : mesh.triangle) ++triangles[root(t[0])];
  gart::triangle_mesh out;
  constexpr gart::u32 none = ~0u;
  std::vector<gart::u32> place(mesh.position.size(), none);
  for (auto t : mesh.triangle) {
    if (triangles[root(t[0])] < least) continue;
    for (gart::u32& v : t) {
      if (place[v] == none)
        place[v] = static_cast<gart::u32>(out.position.size()), out.position.push_back(mesh.position[v]);
      v = place[v];
    }
    out.triangle.push_back(t);
  }
  return out;
}

// About n points of the surface, evenly by area. Each triangle gets its share, with the remainder carried on, at the
// places of the R2 sequence (Roberts).
inline std::vector<gart::vec3> even_samples(gart::triangle_mesh const& mesh, std::size_t n) {
  auto const corner = [&](std::array<gart::u32, 3> const& t, std::size_t k) {
    return gart::vec3d(mesh.position[t[k]]);
  };
  auto const area = [&](std::array<gart::u32, 3> const& t) {
    return 0.5 * glm::length(glm::cross(corner(t, 1) - corner(t, 0), corner(t, 2) - corner(t, 0)));
  };
  double whole = 0, owed = 0;
  for (auto const& t : mesh.triangle) whole += area(t);
  std::vector<gart::vec3> out;
  if (!(whole > 0)) return out;
  double u = 0.5, v = 0.5;
  for (auto const& t : mesh.triangle) {
    for (owed += area(t) / whole * static_cast<double>(n); owed >= 1; owed -= 1) {
      u = std::fmod(u + 0.7548776662466927, 1), v = std::fmod(v + 0.5698402909980532, 1);
      double const a = u + v > 1 ? 1 - u : u, b = u + v > 1 ? 1 - v : v;
      out.push_back(gart::vec3(corner(t, 0) + a * (corner(t, 1) - corner(t, 0)) + b * (corner(t, 2) - corner(t, 0))));
    }
  }
  return out;
}

}  // namespace gart_cli
