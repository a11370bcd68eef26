#pragma once
/// \file
/// How the poses of training views are learned (pose/pose_training.hpp). docs/poses.md has what was measured.

namespace gart {

/// Rates are per visit of a view: about how far Adam moves it.
struct pose_options {
  float warm_up = 0.02f;     ///< share of the run in which poses stay as they are, at most 500 steps
  float until = 0.9f;        ///< share of the run at which the rates have come to their last
  float rate = 2e-3f;        ///< by which the image moves a visit, in radians on the sphere of directions
  float rate_final = 1e-5f;  ///< where it ends; exponential between
  /// What is added to how the image moves (pose/pose_metric.hpp), from and to: at first a view hardly goes where its
  /// image says little, later it does.
  float held = 1.0f, held_final = 1e-3f;
  float prior = 1e-3f;                ///< of the pull to the capture's poses: a loss of half of it times |t|^2 + |w|^2
  float beta1 = 0.9f, beta2 = 0.99f;  ///< Adam's, by visit: a view has few
  /// Images are smaller at first, by this factor and then by half of it, until this share of the run: a pose that is
  /// off by many pixels finds its way in images where it is off by few. A power of two; 1: they never are.
  int coarse = 4;
  float coarse_until = 0.25f;
};

/// By what images are made smaller in a step of a run of so many: two fifths of the coarse share by `coarse`, the rest
/// by half of it.
inline int coarse_factor(pose_options const& o, int step, int iterations) {
  float const share = static_cast<float>(step) / static_cast<float>(iterations > 0 ? iterations : 1);
  if (o.coarse <= 1 || share >= o.coarse_until) return 1;
  return share < 0.4f * o.coarse_until ? o.coarse : o.coarse / 2 > 1 ? o.coarse / 2 : 1;
}

}  // namespace gart
