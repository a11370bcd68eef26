#pragma once
/// \file
/// What a forward pass leaves for its backward pass: of a view or of a batch of rays, by itself, so that others may run
/// in between and no gradient is of anything but what was shown.

#include <gart/rays/ray_batch.hpp>
#include <gart/scene/gaussians.hpp>

namespace gart {

/// Where gradients go, in memory of the policy; null where they are not wanted.
struct gradient_targets {
  /// dL/d the Gaussians, overwritten: of their number, and of the request's SH degree.
  gaussians_view<float> gaussians = {};
  float* pose = nullptr;                   ///< [6]: dL/d the pose of a view, a pose_gradient's numbers in order
  ray_gradient_targets rays = {};          ///< dL/d the rays of a batch
  channel_gradient_targets channels = {};  ///< dL/d features
};

/// Of one forward pass of a renderer, which it must not outlive. What it was given in memory of the policy must stay as
/// it is until the last backward(): rays, and Gaussians and features that are bound.
class forward_context {
 public:
  /// Its memory goes back to the renderer.
  virtual ~forward_context() = default;
  /// From dL/d what was shown; may be called again. Gradients by features, and those by depth and transmittance of a
  /// view where configuration_request.depth did not ask for them, are of its hits, listed once: up to two traces more.
  /// Errors: invalid_argument where the renderer has another model by now, for gradients of another size, and for
  /// targets that a view or a batch has not.
  virtual void backward(output_gradients const& by, gradient_targets const& to) = 0;
};

}  // namespace gart
