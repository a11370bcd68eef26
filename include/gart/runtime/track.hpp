#pragma once
/// \file
/// The pose of a photograph, from a model of the scene and a guess. It makes the image nearest to the photograph.
///
///   auto const renderer = make_renderer({});
///   renderer->set_model(model);
///   track_result const found = track(*renderer, photo, guess, {.render = options});
///
/// Method: least squares of the colours by a quasi-Newton method, from coarse to fine. Image and photograph are
/// blurred, by half as much in each round and in the last not at all. So a guess that is some tens of pixels off still
/// finds the right minimum. The whole renderer gives the gradient (pose/differentiate_pose.hpp). The image alone gives
/// the first curvature, which BFGS then updates. Let d be a pixel's ray in the camera's axes, and q one over the
/// pixel's depth. Let n be the slope of the image at d, on the sphere of directions. The colour changes by q n.t + (d x
/// n).w as the camera moves by t and turns by w. Any camera with one centre.
///
/// Cost of a step: two forward passes, a backward pass and a few passes over the image on the host. Errors:
/// invalid_argument for a photograph, mask or camera of another size; errors of the renderer.

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

/// The result of tracking.
struct track_result {
  camera view;                   ///< the guess, with the pose that was found
  std::vector<float> residuals;  ///< root mean squared error of the best pose after each step, without blur
};

/// Finds the pose by the renderer's model. `photo`: 3 channels, [0, 1]. `mask`: empty, or 1 channel of the photograph's
/// size with 0 where pixels do not count.
track_result track(renderer& renderer, image_float const& photo, camera const& guess, track_options const& options = {},
                   image8 const& mask = {});

}  // namespace gart
