#pragma once
/// \file
/// The two functions that a hit spends most of its arithmetic on, shorter and less exact: what `arithmetic::fast`
/// (math/response.hpp) is made of. Relative errors, for the arguments of hits (tests/math):
///   fast_exponential  x in [-87, 0]: 8e-5 on hosts (a cubic), 2^-21 (1 + |x| / 2) on a device (__expf)
///   fast_reciprocal   2^-23 on a device (rcp.approx); on hosts the exact one, as an estimate with the Newton step it
///                     needs takes no less time
/// The same bits in the forward and backward pass and for every tracer of one policy, not between policies.

#include <gart/math/arith.hpp>
#include <gart/math/lanes.hpp>

namespace gart::inline GART_ISA {

/// 2^n 2^f, n the nearest integer to x / ln 2, 2^f by a cubic that is least in relative error on [-1/2, 1/2].
template <class F>
GART_HD GART_INLINE F fast_exponential(F x) {
#if defined(__CUDA_ARCH__)
  return __expf(x);
#else
  F const shift = 12582912.0f;  // as in exponential
  F const biased = fma(x, F(1.44269504f), shift);
  F const f = fma(x, F(1.44269504f), -add(biased, -shift));
  F p = 0.0551716685f;
  p = fma(p, f, F(0.242611125f));
  p = fma(p, f, F(0.693260968f));
  p = fma(p, f, F(0.999928057f));
  return scale_by_power(p, biased);
#endif
}

/// 1 / a, to the error above.
template <class F>
GART_HD GART_INLINE F fast_reciprocal(F a) {
#if defined(__CUDA_ARCH__)
  float r;
  asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(a));
  return r;
#else
  return reciprocal(a);
#endif
}

}  // namespace gart::inline GART_ISA
