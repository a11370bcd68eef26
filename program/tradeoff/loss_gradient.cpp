#include "loss_gradient.hpp"

#include <gart/exec/parallel.hpp>
#include <gart/loss/image_loss.hpp>

#include <vector>

namespace gart_cli {

gart::image_float loss_gradient(gart::image_float const& image, gart::image8 const& photo, gart::image8 const& mask,
                                gart::vec3 background, float ssim_weight) {
  gart::image_float gradient(image.width, image.height, 3);
  gart::openmp_exec exec;
  gart::image_loss<gart::openmp_exec> loss(exec);
  std::vector<float> value(2);
  loss.evaluate(image.data, {photo.data.data(), photo.channels, mask.empty() ? nullptr : mask.data.data(), background},
                image.width, image.height, ssim_weight, gradient.data, value);
  return gradient;
}

}  // namespace gart_cli
