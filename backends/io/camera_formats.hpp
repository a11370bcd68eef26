#pragma once
// The camera models of files: one table of COLMAP's and nerfstudio's names, numbers and parameters, for every reader.
// A model that gart traces names its kind (scene/camera.hpp); a reader refuses the others by name.

#include <gart/core/span.hpp>
#include <gart/scene/camera.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace gart::io {

struct camera_format {
  int number;  // COLMAP's; below zero where it has none
  std::string_view name;
  std::string_view
      fields;  // COLMAP's parameters in their order, by the names of transforms.json; f: both focal lengths
  std::optional<camera_kind> kind;

  int parameters() const;
  // The field at a place, from 0.
  std::string_view field(int place) const;
  bool has(std::string_view name) const;
};

// Null where there is no such model.
camera_format const* camera_format_of(int number);
camera_format const* camera_format_of(std::string_view name);

// "A, B and C": all that are traced, for errors.
std::string traced_camera_formats();

// A camera's parameter by its name in a format; of lenses by the names of transforms.json.
void set_field(camera& c, std::string_view field, double value);

}  // namespace gart::io
