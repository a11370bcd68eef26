#pragma once
/// \file
/// Several floats at a time, one a lane, for the host policies. The formulas of math/ are templates over the number,
/// and give a lane the bits of a float. There are as many lanes as the compiled instruction set's widest registers
/// hold: 16, 8 or 4 (core/isa.hpp has the one with 16).
///
/// A comparison gives a lane_mask. It has one bit a lane where the machine has such registers, else all bits of a lane
/// or none. select takes the place of ?:. The vectors are the compiler's (GCC, Clang). Intrinsics serve only where the
/// language has no word: masks, square roots and fused multiply-add.

#include <gart/math/arith.hpp>

#include <cstddef>
#include <cstring>

#if !defined(__CUDACC__)

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace gart { inline namespace GART_ISA {

#if defined(GART_LANES_AVX512)
inline constexpr int lane_count = 16;
#elif defined(__AVX2__)
inline constexpr int lane_count = 8;
#else
/// Floats in a register.
inline constexpr int lane_count = 4;
#endif

/// An integer a lane.
using lane_ints = int __attribute__((vector_size(4 * lane_count)));
/// A word a lane.
using lane_words = u32 __attribute__((vector_size(4 * lane_count)));

/// A truth a lane.
struct lane_mask {
#if defined(GART_LANES_AVX512)
  using storage = __mmask16;
#else
  using storage = lane_ints;  ///< a bit a lane, or all bits of a lane
#endif
  storage m;  ///< the lanes'

  /// Of one lane.
  GART_INLINE bool operator[](int lane) const {
#if defined(GART_LANES_AVX512)
    return m >> lane & 1;
#else
    return m[lane] != 0;
#endif
  }
  ///@{
  /// Lane by lane.
  GART_INLINE friend lane_mask operator&(lane_mask a, lane_mask b) { return {static_cast<storage>(a.m & b.m)}; }
  GART_INLINE friend lane_mask operator|(lane_mask a, lane_mask b) { return {static_cast<storage>(a.m | b.m)}; }
  GART_INLINE friend lane_mask operator~(lane_mask a) { return {static_cast<storage>(~a.m)}; }
  GART_INLINE lane_mask& operator&=(lane_mask b) { return *this = *this & b; }
  GART_INLINE lane_mask& operator|=(lane_mask b) { return *this = *this | b; }
  ///@}
};

/// A float a lane.
struct lanes {
  using vector = float __attribute__((vector_size(4 * lane_count)));  ///< the compiler's
  vector v;                                                           ///< the lanes'

  lanes() = default;
  /// The same in every lane.
  GART_INLINE lanes(float x) : v(x - vector{}) {}  ///< x - 0 keeps the sign of a zero
  /// As the compiler has them.
  GART_INLINE lanes(vector x) : v(x) {}

  ///@{
  /// Lane by lane.
  GART_INLINE friend lanes operator+(lanes a, lanes b) { return a.v + b.v; }
  GART_INLINE friend lanes operator-(lanes a, lanes b) { return a.v - b.v; }
  GART_INLINE friend lanes operator*(lanes a, lanes b) { return a.v * b.v; }
  GART_INLINE friend lanes operator/(lanes a, lanes b) { return a.v / b.v; }
  GART_INLINE friend lanes operator-(lanes a) { return -a.v; }
  GART_INLINE lanes& operator+=(lanes b) { return v += b.v, *this; }
  GART_INLINE lanes& operator*=(lanes b) { return v *= b.v, *this; }
  ///@}
#if defined(GART_LANES_AVX512)
  GART_INLINE friend lane_mask operator<(lanes a, lanes b) { return compare<_CMP_LT_OQ>(a, b); }
  GART_INLINE friend lane_mask operator<=(lanes a, lanes b) { return compare<_CMP_LE_OQ>(a, b); }
  GART_INLINE friend lane_mask operator>(lanes a, lanes b) { return compare<_CMP_GT_OQ>(a, b); }
  GART_INLINE friend lane_mask operator>=(lanes a, lanes b) { return compare<_CMP_GE_OQ>(a, b); }
  GART_INLINE friend lane_mask operator==(lanes a, lanes b) { return compare<_CMP_EQ_OQ>(a, b); }

 private:
  template <int How>
  GART_INLINE static lane_mask compare(lanes a, lanes b) {
    return {_mm512_cmp_ps_mask((__m512)a.v, (__m512)b.v, How)};
  }
#else
  ///@{
  /// Lane by lane; false where either is not a number.
  GART_INLINE friend lane_mask operator<(lanes a, lanes b) { return {a.v < b.v}; }
  GART_INLINE friend lane_mask operator<=(lanes a, lanes b) { return {a.v <= b.v}; }
  GART_INLINE friend lane_mask operator>(lanes a, lanes b) { return {a.v > b.v}; }
  GART_INLINE friend lane_mask operator>=(lanes a, lanes b) { return {a.v >= b.v}; }
  GART_INLINE friend lane_mask operator==(lanes a, lanes b) { return {a.v == b.v}; }
  ///@}
#endif
};

/// The same in every lane.
GART_INLINE lane_words every_lane(u32 x) { return lane_words{} + x; }

/// A float a lane.
template <>
struct number<lanes> {
  using mask = lane_mask;    ///< what a comparison gives
  using words = lane_words;  ///< counts or places
  /// That count in every lane.
  GART_INLINE static words every(u32 x) { return every_lane(x); }
};

/// Lane by lane.
GART_INLINE lane_mask both(lane_mask a, lane_mask b) { return a & b; }
#if defined(GART_LANES_AVX512)
GART_INLINE lanes select(lane_mask m, lanes a, lanes b) {
  return (lanes::vector)_mm512_mask_blend_ps(m.m, (__m512)b.v, (__m512)a.v);
}
GART_INLINE lane_words select(lane_mask m, lane_words a, lane_words b) {
  return (lane_words)_mm512_mask_blend_epi32(m.m, (__m512i)b, (__m512i)a);
}
GART_INLINE lane_mask equal(lane_words a, lane_words b) { return {_mm512_cmpeq_epi32_mask((__m512i)a, (__m512i)b)}; }
GART_INLINE lane_mask at_most(lane_words a, lane_words b) { return {_mm512_cmple_epu32_mask((__m512i)a, (__m512i)b)}; }
GART_INLINE lane_mask negative(lanes a) { return {_mm512_movepi32_mask((__m512i)a.v)}; }  ///< -0 too
#else
///@{
/// a where the mask is set, else b.
GART_INLINE lanes select(lane_mask m, lanes a, lanes b) {
#if defined(__AVX2__)
  return (lanes::vector)_mm256_blendv_ps((__m256)b.v, (__m256)a.v, (__m256)m.m);
#else
  return m.m ? a.v : b.v;
#endif
}
GART_INLINE lane_words select(lane_mask m, lane_words a, lane_words b) { return m.m ? a : b; }
///@}
/// Which lanes are equal.
GART_INLINE lane_mask equal(lane_words a, lane_words b) { return {(lane_ints)(a == b)}; }
/// Where a <= b, without a sign.
GART_INLINE lane_mask at_most(lane_words a, lane_words b) { return {(lane_ints)(a <= b)}; }
GART_INLINE lane_mask negative(lanes a) { return {(lane_ints)a.v < 0}; }  ///< -0 too
#endif

/// Bit l is lane l.
GART_INLINE u32 bits_of(lane_mask m) {
#if defined(GART_LANES_AVX512)
  return m.m;
#elif defined(__AVX2__)
  return static_cast<u32>(_mm256_movemask_ps((__m256)m.m));
#else
  u32 bits = 0;
  for (int l = 0; l < lane_count; ++l) bits |= (m.m[l] ? 1u : 0u) << l;
  return bits;
#endif
}
/// The mask of these bits.
GART_INLINE lane_mask lanes_of(u32 bits) {
#if defined(GART_LANES_AVX512)
  return {static_cast<__mmask16>(bits)};
#else
  lane_words own;
  for (int l = 0; l < lane_count; ++l) own[l] = 1u << l;
  return {(lane_ints)((own & bits) == own)};
#endif
}
/// Whether any lane is set.
GART_INLINE bool any(lane_mask m) { return bits_of(m) != 0; }

///@{
/// from[at[l]] of floats or words that begin at `from`, a lane.
GART_INLINE lanes gather(lanes const* from, lane_words at) {
#if defined(GART_LANES_AVX512)
  return (lanes::vector)_mm512_mask_i32gather_ps(_mm512_setzero_ps(), 0xffff, (__m512i)at, from, 4);
#elif defined(__AVX2__)
  return (lanes::vector)_mm256_i32gather_ps(reinterpret_cast<float const*>(from), (__m256i)at, 4);
#else
  lanes r;
  for (int l = 0; l < lane_count; ++l) {
    float one;
    std::memcpy(&one, reinterpret_cast<char const*>(from) + sizeof one * at[l], sizeof one);
    r.v[l] = one;
  }
  return r;
#endif
}
GART_INLINE lane_words gather(lane_words const* from, lane_words at) {
#if defined(GART_LANES_AVX512)
  return (lane_words)_mm512_mask_i32gather_epi32(_mm512_setzero_si512(), 0xffff, (__m512i)at, from, 4);
#elif defined(__AVX2__)
  return (lane_words)_mm256_i32gather_epi32(reinterpret_cast<int const*>(from), (__m256i)at, 4);
#else
  lane_words r;
  for (int l = 0; l < lane_count; ++l) {
    u32 one;
    std::memcpy(&one, reinterpret_cast<char const*>(from) + sizeof one * at[l], sizeof one);
    r[l] = one;
  }
  return r;
#endif
}
///@}

/// Hides the latency of memory: asks for what will be read, or written, some time before.
GART_INLINE void prefetch(void const* p) { __builtin_prefetch(p); }
GART_INLINE void prefetch_to_l2(void const* p) { __builtin_prefetch(p, 0, 2); }  ///< for much at a time
/// For what will be written.
GART_INLINE void prefetch_to_write(void const* p) { __builtin_prefetch(p, 1); }

///@{
/// The arithmetic of arith.hpp.
GART_INLINE lanes mul(lanes a, lanes b) { return a * b; }
GART_INLINE lanes add(lanes a, lanes b) { return a + b; }
GART_INLINE lanes divide(lanes a, lanes b) { return a / b; }
GART_INLINE lanes reciprocal(lanes a) { return lanes(1.0f) / a; }
GART_INLINE lanes fma(lanes a, lanes b, lanes c) {
#if defined(GART_LANES_AVX512)
  return (lanes::vector)_mm512_fmadd_ps((__m512)a.v, (__m512)b.v, (__m512)c.v);
#elif defined(__AVX2__) && defined(GART_FUSED)
  return (lanes::vector)_mm256_fmadd_ps((__m256)a.v, (__m256)b.v, (__m256)c.v);
#else
  lanes r;
  for (int l = 0; l < lane_count; ++l) r.v[l] = fma(a.v[l], b.v[l], c.v[l]);
  return r;
#endif
}
///@}
/// Lane by lane.
GART_INLINE lanes square_root(lanes a) {
#if defined(GART_LANES_AVX512)
  return (lanes::vector)_mm512_maskz_sqrt_ps(0xffff, (__m512)a.v);
#elif defined(__AVX2__)
  return (lanes::vector)_mm256_sqrt_ps((__m256)a.v);
#else
  lanes r;
  for (int l = 0; l < lane_count; ++l) r.v[l] = square_root(a.v[l]);
  return r;
#endif
}
/// |a|.
GART_INLINE lanes magnitude(lanes a) { return (lanes::vector)((lane_words)a.v & 0x7fffffffu); }
/// x 2^n, where `biased` is n + 1.5 * 2^23.
GART_INLINE lanes scale_by_power(lanes x, lanes biased) {
  return x * lanes((lanes::vector)(((lane_words)biased.v + 127u) << 23));
}
/// exp(x), lane by lane.
GART_INLINE lanes exponential(lanes x) { return exponential_of(x); }

}}  // namespace gart::GART_ISA

#endif
