#pragma once
/// \file
/// How the poses of training views are learned (pose/pose_training.hpp). docs/calibration.md has the measurements.

namespace gart {

/// Rates are per visit of a view: about how far Adam moves it.
struct pose_options {
  float warm_up = 0.02f;     ///< share of the run in which poses stay as they are, at most 500 steps
  float until = 0.9f;        ///< share of the run after which the rates are constant
  float rate = 3e-3f;        ///< movement of the image a visit, in radians on the sphere of directions
  float rate_final = 1e-4f;  ///< its last value; exponential between
  /// Damping of the metric (pose/pose_metric.hpp), at first and at the end. A large one keeps a view from moving along
  /// directions that its image hardly determines.
  float damping = 1.0f, damping_final = 1e-3f;
  float prior = 1e-3f;  ///< pull to the capture's poses: adds prior / 2 (|t|^2 + |w|^2) to the loss
  static constexpr float beta1 = 0.9f, beta2 = 0.99f;  ///< Adam's, by visit: a view has few
};

}  // namespace gart
