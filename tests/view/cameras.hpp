#pragma once
// Cameras of these tests.

#include <gart/io/camera_file.hpp>

#include <cmath>
#include <string>

namespace gart_test {

// At a place, turned about its own y axis.
inline gart::camera camera_at(gart::vec3d place, double turned = 0, int width = 64, int height = 48) {
  gart::camera c;
  c.width = width, c.height = height;
  c.fx = c.fy = static_cast<float>(width), c.cx = 0.5f * static_cast<float>(width),
  c.cy = 0.5f * static_cast<float>(height);
  c.position = place;
  float const s = static_cast<float>(std::sin(turned)), k = static_cast<float>(std::cos(turned));
  c.rotation[0] = gart::vec3(k, 0, -s), c.rotation[2] = gart::vec3(s, 0, k);
  return c;
}

inline std::string json_of(gart::camera const& c) { return gart::camera_json({"view", c}); }

inline std::string view_text(gart::camera const& c, bool moving, int id = 1, std::string const& more = "") {
  return R"({"type":"view","id":)" + std::to_string(id) + R"(,"camera":)" + json_of(c) +
         R"(,"mode":"colour","moving":)" + (moving ? "true" : "false") + R"(,"crop":null,"photo":null)" + more + "}";
}

}  // namespace gart_test
