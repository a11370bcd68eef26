#pragma once
/// \file
/// Where a photograph was taken, from a model of the scene and a guess: the pose at which the model's image is nearest
/// to it.
///
///   auto const renderer = make_renderer({});
///   renderer->set_model(model);
///   track_result const found = track(*renderer, photo, guess, {.render = options});
///
/// Least squares of the colours by a quasi-Newton method, from coarse to fine: image and photograph are blurred,
/// at first by a share of the width, then by half of that and so on, and at last not at all, so that a guess some tens
/// of pixels off still falls into the right minimum. The gradient is that of the whole renderer
/// (pose/differentiate_pose.hpp); the first curvature comes from the image alone, what gradients change over steps goes
/// into it (BFGS): with d a pixel's ray in the camera's
/// axes, n the slope of the image on the sphere of directions, there, and q one over its depth, the colour changes by
/// q n . t + (d x n) . w as the camera moves by t and turns by w. Any camera with one centre.
///
/// Cost of a step: two forward passes, a backward pass and a few passes over the image on the host. Errors:
/// invalid_argument for a photograph, mask or camera of another size; what the renderer throws.

#include <gart/exposure/photo_response.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/scene/image.hpp>

#include <vector>

namespace gart {

/// How a photograph is tracked.
struct track_options {
  render_options render = {};    ///< what the model is rendered with, background included
  int steps = 60;                ///< images at most
  float blur = 0.05f;            ///< standard deviation of the first blur over the image's width; 0: none
  photo_response response = {};  ///< what the photograph shows of the scene's colours
};

/// What was found.
struct track_result {
  camera view;                   ///< the guess, with the pose that was found
  std::vector<float> residuals;  ///< root of the mean squared error, not blurred, of the best pose after each step
};

/// The model is the one that the renderer has. photo: 3 channels, [0, 1]; mask: 1 channel of the photograph's size, 0
/// where it is not to be looked at, or empty.
track_result track(renderer& renderer, image_float const& photo, camera const& guess, track_options const& options = {},
                   image8 const& mask = {});

}  // namespace gart
