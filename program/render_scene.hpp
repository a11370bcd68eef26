#pragma once
// What `gart render --scene` and `gart view --scene` share: a scene with its Gaussians, and pictures by paths.

#include "options.hpp"

#include <gart/io/scene_file.hpp>
#include <gart/render/rendered.hpp>
#include <gart/runtime/path_renderer.hpp>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace gart_cli {

// Of the command line; what is not given the scene says.
struct scene_options {
  std::filesystem::path file;
  std::optional<int> bounces;
  std::optional<gart::u64> seed;
  std::string shadows, tone_map;
  std::optional<float> aperture, focus, exposure;

  // usage_error for one of them, and for no model, where no scene is named.
  void require_none(std::filesystem::path const& model, char const* command) const;
};
void add_scene_options(CLI::App& app, scene_options& options);

class path_scene {
 public:
  // `model` is one more, and may be empty. io_error naming the scene's file for what cannot be traced.
  path_scene(scene_options const& options, std::filesystem::path const& model,
             configuration_options const& configuration);

  gart::model_file const& model() const { return model_; }
  gart::scene_file const& file() const { return file_; }
  gart::path_renderer& renderer() { return *renderer_; }
  int samples() const { return file_.paths.samples; }

  // What is around is what the background is, unless `background` says otherwise. Without layers the colour alone.
  gart::rendered draw(gart::camera const& view, gart::render_options options, int samples, bool with_layers = true);
  // Of the last draw with them.
  gart::path_layers const& layers() const { return layers_; }

 private:
  gart::model_file model_;
  gart::scene_file file_;
  std::unique_ptr<gart::path_renderer> renderer_;
  gart::path_layers layers_;
};

}  // namespace gart_cli
