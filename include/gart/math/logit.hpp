#pragma once
/// \file
/// Opacities as they are stored, logits, and as they are: sigmoid(x) = 1 / (1 + exp(-x)), logit(p) = ln(p / (1 - p)).
/// The float's sigmoid has fixed arithmetic (math/arith.hpp), because opacities decide hits; the rest is the
/// platform's.

#include <gart/math/arith.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// 1 / (1 + exp(-x)).
GART_HD GART_INLINE float sigmoid(float x) {
  float const clamped = x < -80.0f ? -80.0f : x;  // below, sigma is under any alpha_min
  return divide(1.0f, add(1.0f, exponential(-clamped)));
}

/// ln(p / (1 - p)).
GART_HD inline float logit(float p) { return logf(p / (1.0f - p)); }

/// 1 / (1 + exp(-x)).
GART_HD inline double sigmoid_in_double(double x) { return 1 / (1 + exp(-x)); }
/// ln(p / (1 - p)).
GART_HD inline double logit_in_double(double p) { return log(p / (1 - p)); }

}}  // namespace gart::GART_ISA
