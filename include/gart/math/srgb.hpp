#pragma once
/// \file
/// sRGB's curve (IEC 61966-2-1), of numbers in [0, 1]: between values for a screen and the light that it shows.

#include <gart/core/macros.hpp>
#include <gart/math/arith.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// @{ Light from displayed values, and displayed values from light. Of floats the same bits on every policy.
inline double linear_light(double x) { return x <= 0.04045 ? x / 12.92 : std::pow((x + 0.055) / 1.055, 2.4); }
GART_HD GART_INLINE float linear_light(float x) {
  if (!(x > 0.04045f)) return x * (1.0f / 12.92f);
  return exponential(2.4f * logarithm((x + 0.055f) * (1.0f / 1.055f)));
}
GART_HD GART_INLINE float displayed(float x) {
  if (!(x > 0.0031308f)) return x * 12.92f;
  return 1.055f * exponential(logarithm(x) * (1.0f / 2.4f)) - 0.055f;
}
/// @}

}}  // namespace gart::GART_ISA
