#pragma once
/// \file
/// What changes with the step: the learning rates and the SH degree in use. Steps count from 0, before the step runs.

#include <gart/core/isa.hpp>
#include <gart/optim/options.hpp>

#include <algorithm>
#include <cmath>

namespace gart { inline namespace GART_ISA {

/// from * (to / from)^(step / steps): log-linear, `to` at and after `steps`. To 0 it falls in a straight line. A rate
/// of 0, or one below it, stays.
inline float exponential_decay(float from, float to, int step, int steps) {
  if (!(from > 0) || steps <= 0) return from;
  double const share = std::clamp(static_cast<double>(step) / steps, 0.0, 1.0);
  if (!(to > 0)) return static_cast<float>(from * (1 - share));
  return static_cast<float>(from * std::pow(static_cast<double>(to) / from, share));
}

/// The rates of one step; `extent` is the scene's.
inline learning_rates rates_at(learning_rates rates, float extent, int step, int steps) {
  double const length = static_cast<double>(std::max(steps, 1)) / std::max(rates.long_run, 1);
  float const scale = static_cast<float>(std::clamp(1 / std::sqrt(length), 1.0, 4.0));
  for (float* rate : {&rates.mean, &rates.mean_final, &rates.log_scale, &rates.opacity}) *rate *= scale;
  rates.mean = exponential_decay(rates.mean, rates.mean_final, step, steps) * extent;
  rates.exposure = exponential_decay(rates.exposure, rates.exposure_final, step, steps);
  rates.vignetting = exponential_decay(rates.vignetting, rates.vignetting_final, step, steps);
  double const late = std::max(0.0f, rates.decay_start_short - rates.decay_start) * std::max(0.0, 1 - length);
  int const from = static_cast<int>((static_cast<double>(rates.decay_start) + late) * steps);
  float const share = exponential_decay(1.0f, rates.final_scale, step - from, steps - from);
  for (float* rate : {&rates.log_scale, &rates.quaternion, &rates.opacity, &rates.sh_dc, &rates.sh_rest})
    *rate *= share;
  return rates;
}

/// Whether a step that ends at `step` images, and has `batch` of them, is one that comes every so many.
inline bool is_multiple(int step, int every, int batch) { return every > 0 && step / every != (step - batch) / every; }

/// Adds a degree every `every` steps, and earlier in short runs. So every run reaches the full degree in its first
/// tenth.
inline int sh_interval(int degree, int every, int steps) { return std::max(1, std::min(every, steps / (10 * degree))); }
/// The degree in use at a step.
inline int sh_degree_at(int step, int degree, int every, int steps) {
  return degree <= 0 ? 0 : std::min(degree, step / sh_interval(degree, every, steps));
}

}}  // namespace gart::GART_ISA
