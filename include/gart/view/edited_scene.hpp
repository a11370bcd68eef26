#pragma once
/// \file
/// A scene of meshes and lights (io/scene_file.hpp) that a viewer changes. Things are moved, turned, made larger, made
/// of another material, lit otherwise, added. It stays a scene.json all the time, so that what is seen can be saved.
///
/// Cost: a move or a turn touches the positions of one mesh. Any other change of a mesh reads the scene's files again.
/// Errors: io_error naming the file, the part and the field; what was there before stays.

#include <gart/io/scene_file.hpp>
#include <gart/view/scene.hpp>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace gart {

/// A scene and its file's text, changed together.
class edited_scene {
 public:
  /// `read` is what was read of the file, from `read.scene` on less `origin`. `model` is one more than the file names;
  /// may be empty. `middle` and `extent`, of the Gaussians, say where handles of lights that stand nowhere are shown.
  edited_scene(std::filesystem::path const& file, scene_file read, vec3d const& origin,
               std::filesystem::path const& model, vec3 const& middle, float extent);
  ~edited_scene();

  /// As it is now, less the origin.
  light::scene const& scene() const;
  /// Its things: meshes by the entries of the file, then the lights that the file has by themselves.
  std::vector<view_part> parts() const;
  /// Changes one. Errors: invalid_argument where there is no such part.
  void change(part_edit const& edit);
  /// Adds a mesh, or puts an HDR or EXR image around all. `name` is that of the saved scene.
  void add(std::filesystem::path const& file, std::string const& name);
  /// The text of its scene.json, with names of files as they were given.
  std::string text() const;

 private:
  struct state;
  std::unique_ptr<state> state_;
};

}  // namespace gart
