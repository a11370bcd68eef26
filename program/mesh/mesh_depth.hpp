#pragma once
// The distances at which a view's rays meet the scene. A ray meets it at the hit behind which less than half of the
// light is left.

#include <gart/exec/openmp.hpp>
#include <gart/render/options.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>

#include <memory>
#include <vector>

namespace gart_cli {

// A ray with where it meets the scene; t is 0 where more than half of its light goes by.
struct met_ray {
  gart::vec3d origin{0.0};
  gart::vec3 direction{0.0f};
  float t = 0;
};

class median_depths {
 public:
  // Of Gaussians of kernel degree 2. Errors: as frame.prepare.
  median_depths(gart::gaussian_model model, gart::render_options const& options);
  ~median_depths();
  // [H][W].
  std::vector<met_ray> of(gart::camera const& view);

 private:
  struct scene;
  std::unique_ptr<scene> scene_;
};

}  // namespace gart_cli
