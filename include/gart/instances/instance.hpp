#pragma once
/// \file
/// Models that stand in one world, each at a pose: actors of a scene. The scene is a model of its own. Host-safe and
/// plain.
///
/// A model is a list of Gaussians in its own axes; any number of instances show it. Gaussians of the scene are numbered
/// instance after instance, in the order of the list.
/// Errors: require_instances throws invalid_argument, naming the instance, the field and the remedy.

#include <gart/core/span.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/features.hpp>
#include <gart/scene/gaussians.hpp>

namespace gart {

/// A model at a pose: x of the model is scale rotation x + position of the world.
struct instance {
  u32 model = 0;        ///< its number in the list of models
  mat3d rotation{1.0};  ///< columns are the model's axes in the world
  vec3d position{0.0};  ///< of the model's origin, in the world
  double scale = 1;     ///< more than 0; it has no gradient
};

/// A Gaussian of the scene, as a Gaussian of an instance.
struct instance_gaussian {
  u32 instance = 0;  ///< its number in the list of instances
  u32 gaussian = 0;  ///< its number in the model
};

/// Where the gradients of a scene's Gaussians go back to, in memory of the policy. Empty or null where they are not
/// wanted. All are overwritten.
struct instance_gradients {
  /// Of each model, of its size and at most the scene's SH degree: summed over its instances, zero without any.
  span<gaussians_view<float> const> models = {};
  span<feature_view<float> const> features = {};  ///< of each model, likewise
  /// [instances][6]: dL/d position in world units, then dL/dw. Here w is a small turn of the instance about its
  /// position: an arm d becomes d + w x d. For cameras pose/pose.hpp has these axes.
  float* poses = nullptr;
};

}  // namespace gart
