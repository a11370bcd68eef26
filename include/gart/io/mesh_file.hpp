#pragma once
/// \file
/// Meshes of triangles in PLY: vertices x y z, faces as lists. Written binary, read in any encoding; faces of more
/// corners are cut into triangles from their first. Errors: io_error naming the file, the face and the remedy. It is
/// thrown for a truncated file and a missing property. Also for a corner that is no vertex, and a vertex that is not
/// finite.

#include <gart/core/types.hpp>
#include <gart/math/glm.hpp>

#include <array>
#include <filesystem>
#include <vector>

namespace gart {

/// Triangles between vertices.
struct triangle_mesh {
  std::vector<vec3> position;                ///< [V]
  std::vector<std::array<u32, 3>> triangle;  ///< [T], counter-clockwise seen from outside
};

/// The file's coordinates less the origin (io/origin.hpp).
triangle_mesh read_mesh_ply(std::filesystem::path const& path, vec3d const& origin = vec3d(0.0));
/// Whole or not at all; in double, the origin added, where there is one.
void write_mesh_ply(std::filesystem::path const& path, triangle_mesh const& mesh, vec3d const& origin = vec3d(0.0));

}  // namespace gart
