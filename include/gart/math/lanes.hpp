#pragma once
// Several floats at a time, one a lane, for the host policies: the formulas of math/ are templates over the number, and
// give a lane the bits they give a float. As many lanes as the machine's widest registers hold: 16, 8 or 4.
//
// A comparison gives a lane_mask, all bits of a lane set or none; select takes the place of ?:. The vectors are the
// compiler's (GCC, Clang); intrinsics stand only where the language has no word: fused multiply-add, masks to bits, and
// reads from an index a lane.

#include <gart/math/arith.hpp>

#if !defined(__CUDACC__)

#if defined(__x86_64__)
#include <immintrin.h>
#endif

namespace gart {

#if defined(__AVX512F__) && defined(__AVX512DQ__)
inline constexpr int lane_count = 16;
#elif defined(__AVX2__)
inline constexpr int lane_count = 8;
#else
inline constexpr int lane_count = 4;
#endif

using lane_ints = int __attribute__((vector_size(4 * lane_count)));
using lane_mask = lane_ints;

struct lanes {
  using vector = float __attribute__((vector_size(4 * lane_count)));
  vector v;

  lanes() = default;
  GART_INLINE lanes(float x) : v(x - vector{}) {}  // x - 0 keeps the sign of a zero
  GART_INLINE lanes(vector x) : v(x) {}

  GART_INLINE friend lanes operator+(lanes a, lanes b) { return a.v + b.v; }
  GART_INLINE friend lanes operator-(lanes a, lanes b) { return a.v - b.v; }
  GART_INLINE friend lanes operator*(lanes a, lanes b) { return a.v * b.v; }
  GART_INLINE friend lanes operator/(lanes a, lanes b) { return a.v / b.v; }
  GART_INLINE friend lanes operator-(lanes a) { return -a.v; }
  GART_INLINE lanes& operator+=(lanes b) { return v += b.v, *this; }
  GART_INLINE lanes& operator*=(lanes b) { return v *= b.v, *this; }
  GART_INLINE friend lane_mask operator<(lanes a, lanes b) { return a.v < b.v; }
  GART_INLINE friend lane_mask operator<=(lanes a, lanes b) { return a.v <= b.v; }
  GART_INLINE friend lane_mask operator>(lanes a, lanes b) { return a.v > b.v; }
  GART_INLINE friend lane_mask operator>=(lanes a, lanes b) { return a.v >= b.v; }
  GART_INLINE friend lane_mask operator==(lanes a, lanes b) { return a.v == b.v; }
};

GART_INLINE lane_mask both(lane_mask a, lane_mask b) { return a & b; }
GART_INLINE lanes select(lane_mask m, lanes a, lanes b) { return m ? a.v : b.v; }
GART_INLINE lane_ints select(lane_mask m, lane_ints a, lane_ints b) { return m ? a : b; }
GART_INLINE lane_ints every_lane(int x) { return lane_ints{} + x; }
GART_INLINE lane_ints lane_numbers() {
  lane_ints r;
  for (int l = 0; l < lane_count; ++l) r[l] = l;
  return r;
}

// Bit l is lane l.
GART_INLINE u32 bits_of(lane_mask m) {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return static_cast<u32>(_mm512_movepi32_mask((__m512i)m));
#elif defined(__AVX2__)
  return static_cast<u32>(_mm256_movemask_ps((__m256)m));
#else
  u32 bits = 0;
  for (int l = 0; l < lane_count; ++l) bits |= (m[l] ? 1u : 0u) << l;
  return bits;
#endif
}
GART_INLINE bool any(lane_mask m) { return bits_of(m) != 0; }

// Lane l: from[index[l]].
GART_INLINE lanes read(float const* from, lane_ints index) {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return (lanes::vector)_mm512_mask_i32gather_ps(_mm512_setzero_ps(), 0xffff, (__m512i)index, from, 4);
#elif defined(__AVX2__)
  return (lanes::vector)_mm256_i32gather_ps(from, (__m256i)index, 4);
#else
  lanes r;
  for (int l = 0; l < lane_count; ++l) r.v[l] = from[index[l]];
  return r;
#endif
}

GART_INLINE lane_ints read(int const* from, lane_ints index) {
  lane_ints r;
  for (int l = 0; l < lane_count; ++l) r[l] = from[index[l]];
  return r;
}

GART_INLINE float sum_of(lanes a) {
  float sum = 0;
  for (int l = 0; l < lane_count; ++l) sum += a.v[l];
  return sum;
}

// The arithmetic of arith.hpp.
GART_INLINE lanes mul(lanes a, lanes b) { return a * b; }
GART_INLINE lanes add(lanes a, lanes b) { return a + b; }
GART_INLINE lanes divide(lanes a, lanes b) { return a / b; }
GART_INLINE lanes reciprocal(lanes a) { return lanes(1.0f) / a; }
GART_INLINE lanes fma(lanes a, lanes b, lanes c) {
#if defined(__AVX512F__) && defined(__AVX512DQ__)
  return (lanes::vector)_mm512_fmadd_ps((__m512)a.v, (__m512)b.v, (__m512)c.v);
#elif defined(__AVX2__) && defined(__FMA__)
  return (lanes::vector)_mm256_fmadd_ps((__m256)a.v, (__m256)b.v, (__m256)c.v);
#else
  lanes r;
  for (int l = 0; l < lane_count; ++l) r.v[l] = fma(a.v[l], b.v[l], c.v[l]);
  return r;
#endif
}
GART_INLINE lanes square_root(lanes a) {
  lanes r;
  for (int l = 0; l < lane_count; ++l) r.v[l] = square_root(a.v[l]);
  return r;
}
GART_INLINE lanes scale_by_power(lanes x, lanes biased) {
  using words = u32 __attribute__((vector_size(4 * lane_count)));
  return x * lanes((lanes::vector)(((words)biased.v + 127u) << 23));
}
GART_INLINE lanes exponential(lanes x) { return exponential_of(x); }

}  // namespace gart

#endif
