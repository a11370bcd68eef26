#pragma once
/// \file
/// The data that the forward pass of a view or a batch of rays keeps for its backward pass. Each context stands alone,
/// so other passes may run in between.

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

/// The context of one forward pass. It must not outlive its renderer. Rays, and Gaussians and features that are bound
/// in the policy's memory, must stay unchanged until the last backward().
class forward_context {
 public:
  /// Gives its memory back to the renderer.
  virtual ~forward_context() = default;
  /// The gradients from dL/d image; may be called again. Gradients by features come from the hits, which are listed
  /// once: up to two traces more. So do those of a view by depth and transmittance where configuration_request.depth
  /// did not ask for them. Errors: invalid_argument where the renderer has had another model since. The same for
  /// gradients of another size, and for targets that do not fit a view or a batch.
  virtual void backward(output_gradients const& by, gradient_targets const& to) = 0;
};

}  // namespace gart
