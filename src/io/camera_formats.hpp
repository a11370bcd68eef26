#pragma once
// The camera models of files: one table of COLMAP's and nerfstudio's names, numbers and parameters, for every reader.
// A model that gart traces names its kind (scene/camera.hpp); a reader refuses the others by name.

#include <gart/scene/camera.hpp>

#include <optional>
#include <string>
#include <string_view>

namespace gart::io {

struct camera_format {
  int number;  // COLMAP's; below zero where it has none
  std::string_view name;
  // COLMAP's parameters in their order, each by its name in files; f: both focal lengths. Behind a = stands the
  // camera's member (scene/camera.hpp) where its name differs.
  std::string_view fields;
  std::optional<camera_kind> kind;

  int parameters() const;
  // The field at a place, from 0: its name in files, and the camera's.
  std::string_view field(int place) const;
  std::string_view member(int place) const;
  bool has(std::string_view name) const;
};

// Null for an unknown model.
camera_format const* camera_format_of(int number);
camera_format const* camera_format_of(std::string_view name);

// "A, B and C": all that are traced, for errors.
std::string traced_camera_formats();

// A camera's parameter by its member's name. Unknown names are passed over.
void set_member(camera& c, std::string_view member, double value);
float member_of(camera const& c, std::string_view member);

// The format that says all of a camera, and is no simpler one's name.
camera_format const& camera_format_for(camera const& c);

// "f", "fx", "fy", "cx" or "cy".
bool is_pinhole_member(std::string_view member);

}  // namespace gart::io
