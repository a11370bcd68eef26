#pragma once
// A photograph for matching: grey levels, shrunk, as a pinhole would see them.

#include <gart/io/dataset.hpp>

#include <optional>
#include <vector>

namespace gart::matching {

struct point2 {
  float x, y;
};

struct photograph {
  photograph() = default;
  // Empty for cameras that no pinhole replaces, and where there is no image.
  explicit photograph(dataset_view const& view);

  bool empty() const { return level.empty(); }
  bool has(int x, int y, int margin) const {
    return x >= margin && y >= margin && x < width - margin && y < height - margin;
  }
  // 1 to 255; 0: nothing is known of this pixel.
  float at(int x, int y) const { return level[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + x]; }
  // Of an image point, in the camera's axes, at depth 1.
  vec3 slopes(float x, float y) const { return {(x - cx) / fx, (y - cy) / fy, 1.0f}; }
  // The pixel of the photograph as it was taken.
  point2 taken_at(float x, float y) const;

  int width = 0, height = 0, shrink = 1;
  float fx = 0, fy = 0, cx = 0, cy = 0;  // of the shrunk image
  mat3 rotation{1.0f};                   // camera to world
  vec3d position{0.0};
  std::vector<u8> level;  // [height][width]

 private:
  void see_through_pinhole(camera const& lens);
  point2 through_lens(float x, float y) const;

  std::vector<point2> lens_;  // where the lens shows each node of a grid, in the shrunk image; none: a pinhole
  int columns_ = 0;           // nodes of a row
};

}  // namespace gart::matching
