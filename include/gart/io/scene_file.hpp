#pragma once
/// \file
/// Scenes of Gaussians, meshes and lights as files: scene.json (docs/light.md has its fields). Meshes by themselves:
/// glTF 2.0 (.gltf, .glb), OBJ with its MTL, and PLY. Files that one names lie beside it. glTF's +y goes up: meshes are
/// turned from it to `up`. Others stand in the world's axes.
///
/// Errors: io_error naming the file, the part, the field and the remedy. It is thrown for damaged or missing parts,
/// unknown fields, and extensions that gart does not have. Triangles without an area or with corners that are not
/// finite are left out, and said in a note. Memory is taken only for counts whose bytes the file has.

#include <gart/light/path_options.hpp>
#include <gart/light/scene.hpp>
#include <gart/scene/camera.hpp>

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace gart {

/// Splats of a scene, and where they stand: p -> scale rotation p + translation.
struct placed_splats {
  std::filesystem::path file;                  ///< of io/splat_file.hpp
  std::array<double, 4> rotation{1, 0, 0, 0};  ///< w, x, y, z, of any length but 0
  double scale = 1;                            ///< positive
  vec3d translation{0.0};                      ///< world units
};

/// The contents of a scene's file besides its splats.
struct scene_file {
  light::scene scene;                 ///< its meshes and lights, less the origin
  std::vector<int> mesh_entries;      ///< [scene.meshes]: places in the "meshes" of a scene.json; else empty
  light::path_options paths;          ///< by its "options", else the defaults
  std::optional<vec3> background;     ///< linear RGB
  std::vector<named_camera> cameras;  ///< in the world; may be none
  std::vector<std::string> notes;     ///< a line each: what was left out
};

/// The splats that a scene's file names; the file itself where it is a GLB or glTF with Gaussians. May be none.
std::vector<placed_splats> read_scene_splats(std::filesystem::path const& path);

/// All but the splats, which stand in the world less `origin` (io/origin.hpp).
scene_file read_scene(std::filesystem::path const& path, vec3d const& origin = vec3d(0.0));
/// The same of the text of a scene.json that would lie at `path`.
scene_file read_scene_text(std::string const& text, std::filesystem::path const& path,
                           vec3d const& origin = vec3d(0.0));

}  // namespace gart
