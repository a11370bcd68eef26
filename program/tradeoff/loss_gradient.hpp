#pragma once
// The gradient of the training loss (loss/image_loss.hpp), in a library of kernels (CMakeLists.txt says why).

#include <gart/math/glm.hpp>
#include <gart/scene/image.hpp>

namespace gart_cli {

// Of an image, against a photograph of its size over a background. mask: empty, or zero where nothing counts.
gart::image_float loss_gradient(gart::image_float const& image, gart::image8 const& photo, gart::image8 const& mask,
                                gart::vec3 background, float ssim_weight);

}  // namespace gart_cli
