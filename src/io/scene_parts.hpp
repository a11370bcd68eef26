#pragma once
// What scene.json is read by: a reader a kind of mesh file, and shapes that need none.

#include "surface.hpp"

#include <gart/scene/camera.hpp>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace gart::io {

// The scene of a glTF or GLB file: its meshes and materials, its lights, and its cameras with 720 lines. `turned` goes
// from +y up to the world's axes and is in `place` already.
struct gltf_parts {
  light::scene scene;
  std::vector<named_camera> cameras;
};
gltf_parts read_gltf_scene(std::filesystem::path const& path, mesh_place const& place, std::vector<std::string>& notes);
// Whether it has Gaussians (KHR_gaussian_splatting), or a mesh of triangles.
struct gltf_contents {
  bool splats = false, meshes = false;
};
gltf_contents gltf_contents_of(std::filesystem::path const& path);

light::scene read_obj_scene(std::filesystem::path const& path, mesh_place const& place,
                            std::vector<std::string>& notes);
light::scene read_ply_scene(std::filesystem::path const& path, mesh_place const& place,
                            std::vector<std::string>& notes);

// From -1 to 1 in each axis that they have, +y up. The plane faces up, the torus is about y.
inline constexpr char const* shape_names[] = {"sphere", "box", "plane", "torus"};
raw_mesh shape_named(std::string_view name);

// The shortest turn from +y to `up`, about z where it is half a turn.
mat3d turn_from_y(vec3d const& up);

}  // namespace gart::io
