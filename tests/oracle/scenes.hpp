#pragma once
// Seeded scenes that a ray tracer of Gaussians gets wrong first: overlap, needles, equal distances, cameras inside
// Gaussians, opaque stacks, thousands of hits on a ray, every SH degree, distorted lenses, odd image sizes.

#include <gart/render/options.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>

#include <cstdint>
#include <string>
#include <vector>

namespace oracle {

struct scene {
  std::string name;
  gart::gaussian_model model;
  gart::camera view;
  gart::render_options options;
  int active_degree = 0;
};

// The same seed gives the same scenes with every compiler.
std::vector<scene> scenes(std::uint64_t seed);

// A cloud of SH degree 0 with some ellipsoids that reach around the camera, another for each kernel degree.
scene kernel_scene(std::uint64_t seed, int kernel_degree);

// A few Gaussians and pixels whose image has no steps: alpha_min 1e-12, near and transmittance_min out of reach.
// `sh_degree` in 0..3; `aspect` is the ratio of the longest to the shortest axis.
scene smooth_scene(std::uint64_t seed, int sh_degree, float aspect);

}  // namespace oracle
