// What a viewer is told of a model, and a part of a model.

#include "bulk_range.hpp"

#include <gart/scene/select.hpp>
#include <gart/view/scene.hpp>

#include <algorithm>
#include <cmath>
#include <tuple>

namespace gart {

float extent_of(view_scene const& scene) {
  vec3 const half = 0.5f * (scene.bounds.high - scene.bounds.low);
  return std::sqrt(glm::dot(half, half));
}

view_scene scene_of(std::string name, gaussian_model const& model, int kernel_degree,
                    std::vector<view_camera> cameras) {
  view_scene scene;
  scene.name = std::move(name), scene.gaussians = model.size(), scene.sh_degree = model.sh_degree;
  scene.kernel_degree = kernel_degree;
  std::vector<float> along(model.size());
  for (int k = 0; k < 3; ++k) {
    for (std::size_t i = 0; i < model.size(); ++i) along[i] = model.mean[3 * i + static_cast<std::size_t>(k)];
    std::tie(scene.bounds.low[k], scene.bounds.high[k]) = view::bulk_range(along, {-1.0f, 1.0f});
  }
  vec3 up(0.0f);
  for (view_camera const& c : cameras) up -= c.view.rotation[1];
  float const length = std::sqrt(glm::dot(up, up));
  // Cameras that look everywhere agree on nothing.
  if (length > 0.1f * static_cast<float>(cameras.size()) && length > 0) scene.up = up / length;
  scene.cameras = std::move(cameras);
  return scene;
}

gaussian_model cropped(gaussian_model const& model, view_box const& box) {
  std::vector<u32> kept;
  for (std::size_t i = 0; i < model.size(); ++i) {
    bool inside = true;
    for (std::size_t k = 0; k < 3; ++k) {
      int const axis = static_cast<int>(k);
      inside = inside && model.mean[3 * i + k] >= box.low[axis] && model.mean[3 * i + k] <= box.high[axis];
    }
    if (inside) kept.push_back(static_cast<u32>(i));
  }
  return selected(model, kept);
}

}  // namespace gart
