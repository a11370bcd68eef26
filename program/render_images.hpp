#pragma once
// The images of `gart render --images`: what each is, as files beside NAME.png.

#include <gart/render/rendered.hpp>
#include <gart/runtime/path_renderer.hpp>
#include <gart/scene/camera.hpp>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <string>
#include <vector>

namespace gart_cli {

struct image_choice {
  std::string images = "colour";  // names, by commas
  std::string format = "png";     // of all but colour: png, npy or exr
  double depth_unit = 0.001;      // of a step of 16 bits

  bool has(std::string const& name) const;
  static std::vector<std::string> const& names();
};
// usage_error for a name that there is not.
void check_images(image_choice const& choice);

// Writes the chosen images, the colour as EXR alone, and adds their numbers to `entry`. Throws usage_error where 16
// bits cannot hold the values.
void write_images(std::filesystem::path const& folder, std::string const& name, gart::rendered const& image,
                  gart::camera const& view, image_choice const& choice, nlohmann::json& entry);

// What paths met first: of these images albedo, surface and ids.
void write_layers(std::filesystem::path const& folder, std::string const& name, gart::path_layers const& layers,
                  image_choice const& choice);

}  // namespace gart_cli
