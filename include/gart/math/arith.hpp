#pragma once
/// \file
/// Float arithmetic whose rounding is fixed by the source, not by the compiler's choice to contract a*b+c. Code that
/// decides a hit, an order or an address uses these. So forward and backward, every traverser and (on hosts with FMA)
/// every policy compute the same bits. Host code that uses gart is built with -ffp-contract=off, which the CMake target
/// carries. On a device the intrinsics are never contracted.

#if defined(__FAST_MATH__) || (defined(__FINITE_MATH_ONLY__) && __FINITE_MATH_ONLY__)
#error "gart decides hits by IEEE arithmetic: compile what includes it without -ffast-math and -ffinite-math-only"
#endif

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

#include <cmath>
#include <cstring>

namespace gart { inline namespace GART_ISA {

/// a * b, rounded once.
GART_HD GART_INLINE float mul(float a, float b) {
#if defined(__CUDA_ARCH__)
  return __fmul_rn(a, b);
#else
  return a * b;
#endif
}

/// a + b.
GART_HD GART_INLINE float add(float a, float b) {
#if defined(__CUDA_ARCH__)
  return __fadd_rn(a, b);
#else
  return a + b;
#endif
}

/// a*b + c, in one rounding wherever the machine has it (two on a host built without FMA).
GART_HD GART_INLINE float fma(float a, float b, float c) {
#if defined(__CUDA_ARCH__)
  return __fmaf_rn(a, b, c);
#elif defined(GART_FUSED)
  return __builtin_fmaf(a, b, c);
#else
  return a * b + c;
#endif
}

/// a / b, correctly rounded.
GART_HD GART_INLINE float divide(float a, float b) {
#if defined(__CUDA_ARCH__)
  return __fdiv_rn(a, b);
#else
  return a / b;
#endif
}

/// 1 / a, correctly rounded.
GART_HD GART_INLINE float reciprocal(float a) {
#if defined(__CUDA_ARCH__)
  return __frcp_rn(a);
#else
  return 1.0f / a;
#endif
}

/// The square root, correctly rounded.
GART_HD GART_INLINE float square_root(float a) {
#if defined(__CUDA_ARCH__)
  return __fsqrt_rn(a);
#else
  return std::sqrt(a);
#endif
}

/// The float of these bits.
GART_HD GART_INLINE float bits_to_float(u32 bits) {
#if defined(__CUDA_ARCH__)
  return __uint_as_float(bits);
#else
  float f;
  std::memcpy(&f, &bits, sizeof f);
  return f;
#endif
}

/// The bits of a float.
GART_HD GART_INLINE u32 float_to_bits(float f) {
#if defined(__CUDA_ARCH__)
  return __float_as_uint(f);
#else
  u32 bits;
  std::memcpy(&bits, &f, sizeof bits);
  return bits;
#endif
}

/// Reciprocals of several numbers, the bits of reciprocal(). A device's is an estimate and a Newton step. Where the
/// number or its reciprocal is not normal it branches, and everything around it waits. Here the steps are taken for all
/// of them, and one branch is left.
template <int N>
GART_HD GART_INLINE void reciprocals(float (&a)[N]) {
#if defined(__CUDA_ARCH__)
  float out[N];
  bool usual = true;
  GART_UNROLL
  for (int i = 0; i < N; ++i) {
    usual &= ((float_to_bits(a[i]) + 0x01800000u) & 0x7f800000u) > 0x01ffffffu;  // 2^-126 to 2^126
    float estimate;
    asm("rcp.approx.ftz.f32 %0, %1;" : "=f"(estimate) : "f"(a[i]));
    out[i] = __fmaf_rn(estimate, -__fmaf_rn(a[i], estimate, -1.0f), estimate);
  }
  if (!usual) {
    GART_UNROLL
    for (int i = 0; i < N; ++i) out[i] = reciprocal(a[i]);
  }
  GART_UNROLL
  for (int i = 0; i < N; ++i) a[i] = out[i];
#else
  for (float& x : a) x = reciprocal(x);
#endif
}

/// By the exponent bits, so that no fast-math switch can remove it.
GART_HD GART_INLINE bool is_finite(float f) { return (float_to_bits(f) & 0x7f800000u) != 0x7f800000u; }

/// For formulas over floats and over lanes of them (math/lanes.hpp). It has the types of a number's comparisons and
/// counts, and their operations.
template <class F>
struct number;
/// One float.
template <>
struct number<float> {
  using mask = bool;  ///< what a comparison gives
  using words = u32;  ///< a count or a place
  /// That count.
  GART_HD GART_INLINE static words every(u32 x) { return x; }
};
/// Whether both are true; with lanes, of each lane.
GART_HD GART_INLINE bool both(bool a, bool b) { return a && b; }
/// Whether any lane is.
GART_HD GART_INLINE bool any(bool a) { return a; }
/// |a|.
GART_HD GART_INLINE float magnitude(float a) { return fabsf(a); }
///@{
/// a where `which` is true, else b; with lanes, of each lane.
GART_HD GART_INLINE float select(bool which, float a, float b) { return which ? a : b; }
GART_HD GART_INLINE u32 select(bool which, u32 a, u32 b) { return which ? a : b; }
///@}

/// x 2^n, where `biased` is n + 1.5 * 2^23.
GART_HD GART_INLINE float scale_by_power(float x, float biased) {
  return mul(x, bits_to_float((float_to_bits(biased) + 127u) << 23));
}

/// exp(x) for x in [-87, 88]: Cody-Waite reduction and a polynomial of degree 6, the same operations on every policy.
/// Below -87 it is 0. Relative error under 2 ulp (tests/math).
template <class F>
GART_HD GART_INLINE F exponential_of(F x) {
  F const shift = 12582912.0f;  // 1.5 * 2^23: adding it rounds to an integer in the low mantissa bits
  F const biased = fma(x, F(1.44269504f), shift);
  F const n = add(biased, -shift);
  F r = fma(n, F(-0.693359375f), x);
  r = fma(n, F(2.12194440e-4f), r);
  F p = 1.9875691500e-4f;
  p = fma(p, r, F(1.3981999507e-3f));
  p = fma(p, r, F(8.3334519073e-3f));
  p = fma(p, r, F(4.1665795894e-2f));
  p = fma(p, r, F(1.6666665459e-1f));
  p = fma(p, r, F(5.0000001201e-1f));
  p = add(fma(mul(r, r), p, r), F(1.0f));
  return select(x < F(-87.0f), F(0.0f), scale_by_power(p, biased));
}
/// exp(x) of one float.
GART_HD GART_INLINE float exponential(float x) { return exponential_of(x); }

/// exp(x) where it decides no hit: on a device by its estimate, within 2^-20 for x in [-16, 0].
template <class F>
GART_HD GART_INLINE F estimated_exponential_of(F x) {
#if defined(__CUDA_ARCH__)
  float r;
  asm("ex2.approx.ftz.f32 %0, %1;" : "=f"(r) : "f"(x * 1.44269504f));
  return r;
#else
  return exponential_of(x);
#endif
}

/// ln(x) for positive normal x: mantissa in [sqrt(1/2), sqrt(2)) and a polynomial, the same operations on every policy.
/// Relative error under 2 ulp away from 1 (tests/math).
GART_HD GART_INLINE float logarithm(float x) {
  u32 const bits = float_to_bits(x) - 0x3f3504f3u;
  float const e = static_cast<float>(static_cast<int>(bits) >> 23);
  float const f = add(bits_to_float((bits & 0x007fffffu) + 0x3f3504f3u), -1.0f);
  float p = 7.0376836292e-2f;
  p = fma(p, f, -1.1514610310e-1f);
  p = fma(p, f, 1.1676998740e-1f);
  p = fma(p, f, -1.2420140846e-1f);
  p = fma(p, f, 1.4249322787e-1f);
  p = fma(p, f, -1.6668057665e-1f);
  p = fma(p, f, 2.0000714765e-1f);
  p = fma(p, f, -2.4999993993e-1f);
  p = fma(p, f, 3.3333331174e-1f);
  float const f2 = mul(f, f);
  float y = mul(mul(f, f2), p);
  y = fma(e, -2.12194440e-4f, y);
  y = fma(f2, -0.5f, y);
  return fma(e, 0.693359375f, add(f, y));
}

}}  // namespace gart::GART_ISA
