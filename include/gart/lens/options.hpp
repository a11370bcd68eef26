#pragma once
/// \file
/// How the lenses of a capture are learned (lens/lens_training.hpp). docs/calibration.md has the measurements.

namespace gart {

/// Rates are per step of a view through the lens. A rate is about how far Adam moves the image, over the focal length.
struct lens_options {
  float warm_up = 0.02f;     ///< share of the run in which lenses stay as they are, at most 500 steps
  float until = 0.9f;        ///< share of the run after which the rates are constant
  float rate = 2e-3f;        ///< at first
  float rate_final = 1e-5f;  ///< its last value; exponential between
  static constexpr float beta1 = 0.9f, beta2 = 0.99f;  ///< Adam's
};

}  // namespace gart
