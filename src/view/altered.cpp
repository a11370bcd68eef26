// What is traced of a model where a viewer wants it otherwise than it is.

#include <gart/math/logit.hpp>
#include <gart/scene/select.hpp>
#include <gart/view/scene.hpp>

#include <algorithm>
#include <cmath>

namespace gart {

namespace {

constexpr float point_radius = 0.004f;                        // of the extent
constexpr float nearly_one = 1 - 1e-6f, nearly_none = 1e-6f;  // opacity

// Standard deviations from the centre at which an opaque Gaussian has solid_response: exp(-4.5 (d / 3)^n).
float rim(int kernel_degree) {
  return 3 * std::pow(-std::log(solid_response) / 4.5f, 1 / static_cast<float>(kernel_degree));
}

float opacity_of(gaussian_model const& model, std::size_t i, float factor) {
  return factor * static_cast<float>(sigmoid_in_double(static_cast<double>(model.opacity[i])));
}

gaussian_model without_faint(gaussian_model const& model, float factor) {
  std::vector<u32> kept;
  for (std::size_t i = 0; i < model.size(); ++i)
    if (opacity_of(model, i, factor) >= faintest_solid) kept.push_back(static_cast<u32>(i));
  return selected(model, kept);
}

}  // namespace

gaussian_model altered(gaussian_model model, view_settings const& settings, int kernel_degree, float extent) {
  if (settings.crop) model = cropped(model, *settings.crop);
  bool const solid = settings.shape != view_shape::gaussians;
  if (solid) model = without_faint(model, settings.opacity);
  float const larger = std::log(settings.size) - (solid ? std::log(rim(kernel_degree)) : 0.0f);
  if (settings.shape == view_shape::points)
    std::fill(model.log_scale.begin(), model.log_scale.end(), std::log(point_radius * std::max(extent, 1e-20f)));
  for (float& s : model.log_scale) s += larger;
  for (std::size_t i = 0; i < model.size(); ++i) {
    if (!solid && settings.opacity == 1) break;
    float const alpha =
        solid ? nearly_one : std::clamp(opacity_of(model, i, settings.opacity), nearly_none, nearly_one);
    model.opacity[i] = std::log(alpha / (1 - alpha));
  }
  return model;
}

}  // namespace gart
