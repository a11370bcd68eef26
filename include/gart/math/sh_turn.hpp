#pragma once
/// \file
/// How colours change as rays turn. Where every direction turns by a small w, d + w x d,
///   dY_k = sum_a w_a sum_l G^a_kl Y_l,
/// G^a the generators of rotations in the basis of math/sh.hpp: antisymmetric, a band for itself, few entries a row. So
/// the derivative of a function of colours by w needs what its gradient by the coefficients holds already:
///   dL/dw_a = sum_kl c_k G^a_kl dL/dc_l,   since dL/dc_l is a sum of Y_l over the hits.
/// For one hit dL/dc_l is Y_l times the gradient of its colour. So one channel will do: c_k summed with that gradient.

#include <gart/core/macros.hpp>
#include <gart/math/glm.hpp>

namespace gart { inline namespace GART_ISA {

/// dL/dw of one Gaussian: its coefficients c and their gradient g, [size][Channels] each, of bands up to Degree.
template <int Degree, int Channels = 3>
GART_HD GART_INLINE vec3 sh_turn(float const* c, float const* g) {
  vec3 out(0.0f);
  // c_k G_kl g_l and c_l G_lk g_k, for G_kl = 1.
  auto const pair = [&](int k, int l) {
    float sum = 0;
    GART_UNROLL
    for (int channel = 0; channel < Channels; ++channel)
      sum +=
          c[Channels * k + channel] * g[Channels * l + channel] - c[Channels * l + channel] * g[Channels * k + channel];
    return sum;
  };
  if constexpr (Degree >= 1) {
    out.x += pair(1, 2);
    out.y += pair(2, 3);
    out.z += pair(1, 3);
  }
  if constexpr (Degree >= 2) {
    float const root3 = 1.7320508075688772f;
    out.x += pair(4, 7) + pair(5, 8) + root3 * pair(5, 6);
    out.y += pair(7, 8) - pair(4, 5) + root3 * pair(6, 7);
    out.z += 2 * pair(4, 8) + pair(5, 7);
  }
  if constexpr (Degree >= 3) {
    float const narrow = 1.2247448713915890f, middle = 1.5811388300841898f, wide = 2.4494897427831781f;
    out.x += narrow * (pair(9, 14) + pair(10, 15)) + middle * (pair(10, 13) + pair(11, 14)) + wide * pair(11, 12);
    out.y += narrow * (pair(14, 15) - pair(9, 10)) + middle * (pair(13, 14) - pair(10, 11)) + wide * pair(12, 13);
    out.z += 3 * pair(9, 15) + 2 * pair(10, 14) + pair(11, 13);
  }
  return out;
}

}}  // namespace gart::GART_ISA
