#pragma once
/// \file
/// The options of the optimizer and of the three ways to densify. docs/training.md has measurements for defaults that
/// differ from the literature (3DGS, 3DGS-MCMC, gsplat).

#include <algorithm>

namespace gart {

/// Adam's rates, by parameter.
struct learning_rates {
  float mean = 0.8e-4f;        ///< times the scene's extent; decays exponentially to mean_final over the run
  float mean_final = 0.8e-6f;  ///< where the mean's rate ends
  float log_scale = 5e-3f;     ///< of the logarithms
  float quaternion = 1e-3f;    ///< of the raw quaternion
  float opacity = 2.5e-2f;     ///< of the logit
  float sh_dc = 2.5e-3f;       ///< of the first band
  float sh_rest = 1e-3f;       ///< of the bands above the first: eight times 3DGS', with train_options::sh_penalty
  /// All rates except those of means, exposures and lenses are constant for a share of the run. Then they decay
  /// exponentially to `final_scale` times their value.
  float final_scale = 0.1f;                   ///< a rate's last value over its first
  static constexpr float decay_start = 0.5f;  ///< share of the run before the decay
  /// The rates suit runs of at least so many steps. Shorter runs multiply the rates of mean, scale and opacity by
  /// sqrt(long_run / steps), at most by four. Their decay starts later, the shorter the run, at most at
  /// decay_start_short.
  int long_run = 15000;
  float decay_start_short = 0.9f;                  ///< share of the shortest runs before the decay
  float exposure = 0.05f;                          ///< a visit of the view; decays like the means'
  static constexpr float exposure_final = 0.005f;  ///< where it ends
  /// Share of the run before exposures move. First Gaussians are faint, and exposures would make up for that.
  static constexpr float exposure_rest = 0.07f;
  float vignetting = 1e-2f, vignetting_final = 1e-4f;  ///< a visit of the lens; likewise
};

/// Adam's constants.
struct adam_options {
  static constexpr float beta1 = 0.9f, beta2 = 0.999f, epsilon = 1e-15f;  ///< as in adam.hpp
  bool sparse = false;  ///< Gaussians that the step's view did not show stay as they are (adam.hpp)
  /// Added to the gradient of each coefficient above the first band that has one, times the coefficient.
  float sh_pull = 0;
};

/// The opacity below which a Gaussian is useless: `opacity` at the default alpha_min of 1/255, and proportional above.
/// A Gaussian fainter than alpha_min is never hit, so no gradient would ever change it.
inline float least_opacity(float opacity, float alpha_min) { return std::max(opacity, 255 * opacity * alpha_min); }

/// Of Markov chain Monte Carlo (train/densify/mcmc.hpp).
struct mcmc_options {
  int from = 500, every = 100;  ///< steps: the first, and from one to the next
  float until = 5.0f / 6;       ///< share of the run
  float growth = 1.05f;         ///< a step of growth, up to max_gaussians; more in runs too short for it (growth_for)
  float dead_opacity = 0.005f;  ///< least opacity at the default alpha_min (least_opacity)
  float noise = 1e6f;           ///< times the rate of the means, and the covariance in units of the extent
  float opacity_penalty = 0.01f, scale_penalty = 0.014f;  ///< the scale in units of the extent
};

/// How one Gaussian becomes two along its longest axis (optim/long_axis_split.hpp).
struct split_shape {
  /// q, in (0, 1): the children' centres lie at +-q 3 s, and they are 1 - q times as long. 0: by the capture's pixels
  /// (split_offset).
  float offset = 0;
  float opacity = 0.6f;  ///< what opacity is multiplied by
};

/// Of growth by error (train/densify/error_growth.hpp).
struct error_growth_options {
  int from = 500, every = 100;     ///< steps: the first, and from one to the next
  float growth_end = 0.5f;         ///< share of the run at which the count has reached its budget
  float until = 5.0f / 6;          ///< share of the run after which the dead stay where they are
  float dead_opacity = 0.005f;     ///< least opacity at the default alpha_min (least_opacity)
  float opacity_penalty = 0.003f;  ///< times the mean opacity (and train/foreground_fraction.hpp)
  split_shape split;               ///< how one becomes two
  /// The count ends at one Gaussian for this many pixels of the training views. More would overfit them, and take time
  /// and memory. 0: at max_gaussians, whatever the capture.
  float pixels_per_gaussian = 200;
  int min_gaussians = 100'000;  ///< that pixels_per_gaussian leaves to the smallest capture
  bool draw_by_root = true;     ///< draws by the root of the error; false: by the error
};

/// Of adaptive density control (train/densify/adc.hpp).
struct adc_options {
  int from = 500, every = 100, opacity_reset_every = 3000;  ///< steps: the first, and from one to the next
  float until = 0.5f;                                       ///< share of the run
  float gradient = 2e-4f;        ///< mean length of the mean's gradient in the image that makes a Gaussian grow
  float dense = 0.01f;           ///< times the extent: larger ones split, smaller ones are cloned
  float prune_opacity = 0.005f;  ///< least opacity at the default alpha_min (least_opacity)
  static constexpr float prune_scale = 0.1f;  ///< times the extent, after the first opacity reset
};

}  // namespace gart
