#pragma once
// What readers of meshes share: where a file's triangles stand, which can be traced, and images as textures.

#include <gart/light/scene.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/image.hpp>

#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace gart::io {

// p -> linear p + translation, in double.
struct placing {
  mat3d linear{1.0};
  vec3d translation{0.0};
  vec3d operator()(vec3d const& p) const { return linear * p + translation; }
};
// First b, then a.
inline placing operator*(placing const& a, placing const& b) { return {a.linear * b.linear, a(b.translation)}; }

// A mesh as a file has it, before it is placed; normals and uvs of each vertex, or none.
struct raw_mesh {
  std::string name;
  std::vector<vec3d> position;
  std::vector<vec3> normal;
  std::vector<vec2> uv;
  std::vector<std::array<u32, 3>> triangle;
  std::vector<u32> material;  // of each triangle
};

// Where meshes of a file go: placed, then less the origin.
struct mesh_place {
  placing where;
  vec3d origin{0.0};
};
// Adds it to the meshes. Triangles without an area are left out. So are those with a corner that is not finite or
// further than 1e15 away. A note counts them, and meshes without any left. Corners must be vertices.
void add_placed(light::scene& to, raw_mesh const& raw, mesh_place const& place, std::string const& file,
                std::vector<std::string>& notes);
// io_error, naming `file` and the last note, if there is no mesh.
void require_meshes(light::scene const& scene, std::string const& file, std::vector<std::string> const& notes);

// An image of 1, 3 or 4 channels; `colours` are in sRGB's curve.
light::texture texture_of(image8 const& image, bool colours, std::string name);

// The parts of another, with the numbers of their materials and textures.
void append(light::scene& all, light::scene part);

}  // namespace gart::io
