#pragma once
/// \file
/// How the poses of training views are learned (pose/pose_training.hpp). docs/calibration.md has what was measured.

namespace gart {

/// Rates are per visit of a view: about how far Adam moves it.
struct pose_options {
  float warm_up = 0.02f;     ///< share of the run in which poses stay as they are, at most 500 steps
  float until = 0.9f;        ///< share of the run at which the rates have come to their last
  float rate = 3e-3f;        ///< by which the image moves a visit, in radians on the sphere of directions
  float rate_final = 1e-4f;  ///< where it ends; exponential between
  /// Damping of the metric (pose/pose_metric.hpp), at first and at the end. A large one keeps a view from moving along
  /// directions that its image hardly determines.
  float damping = 1.0f, damping_final = 1e-3f;
  float prior = 1e-3f;  ///< of the pull to the capture's poses: a loss of half of it times |t|^2 + |w|^2
  static constexpr float beta1 = 0.9f, beta2 = 0.99f;  ///< Adam's, by visit: a view has few
};

}  // namespace gart
