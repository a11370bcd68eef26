#pragma once
/// \file
/// Several floats at a time, one a lane, for the host policies. The formulas of math/ are templates over the number,
/// and give a lane the bits of a float. There are as many lanes as the compiled instruction set's widest registers
/// hold: 16, 8 or 4 (core/isa.hpp has the one with 16).
///
/// A comparison gives a lane_mask. It has one bit a lane where the machine has such registers, else all bits of a lane
/// or none. select takes the place of ?:. The vectors are the compiler's (GCC, Clang). Intrinsics serve only where the
/// language has no word: masks, fused multiply-add, and the transposition of four numbers a lane.

#include <gart/math/arith.hpp>

#include <cstddef>

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
GART_INLINE lanes select(lane_mask m, lanes a, lanes b) { return m.m ? a.v : b.v; }
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
  return {(lane_ints)((own & bits) != 0)};
#endif
}
/// Whether any lane is set.
GART_INLINE bool any(lane_mask m) { return bits_of(m) != 0; }

/// out[k]: the sum of all lanes of a[k]; zeros from N on.
template <int N>
GART_INLINE void sums_of(lanes const (&a)[N], float (&out)[16]) {
  static_assert(N <= 16);
#if defined(GART_LANES_AVX512)
  // Numbers and lanes change places, and halves are added, until each lane holds one number's sum.
  __m512 x[16];
#pragma GCC unroll 16
  for (int k = 0; k < 16; ++k) x[k] = k < N ? (__m512)a[k < N ? k : 0].v : _mm512_setzero_ps();
  for (int k = 0; k < 8; ++k)
    x[k] = _mm512_add_ps(_mm512_maskz_unpacklo_ps(0xffff, x[2 * k], x[2 * k + 1]),
                         _mm512_maskz_unpackhi_ps(0xffff, x[2 * k], x[2 * k + 1]));
  for (int k = 0; k < 4; ++k) {
    __m512d const p = _mm512_castps_pd(x[2 * k]), q = _mm512_castps_pd(x[2 * k + 1]);
    x[k] = _mm512_add_ps(_mm512_castpd_ps(_mm512_maskz_unpacklo_pd(0xff, p, q)),
                         _mm512_castpd_ps(_mm512_maskz_unpackhi_pd(0xff, p, q)));
  }
  for (int n = 2; n > 0; n /= 2)
    for (int k = 0; k < n; ++k)
      x[k] = _mm512_add_ps(_mm512_maskz_shuffle_f32x4(0xffff, x[2 * k], x[2 * k + 1], 0x88),
                           _mm512_maskz_shuffle_f32x4(0xffff, x[2 * k], x[2 * k + 1], 0xdd));
  _mm512_storeu_ps(out, x[0]);
#else
  for (float& one : out) one = 0;
  for (int k = 0; k < N; ++k) {
    lanes s = a[k];
    for (int half = lane_count / 2; half > 0; half /= 2)
      for (int l = 0; l < half; ++l) s.v[l] += s.v[l + half];
    out[k] = s.v[0];
  }
#endif
}

/// a[0] b[0] c[0] a[1] and so on: the first n of them, at most three times the lanes.
GART_INLINE void write_interleaved(float* out, int n, lanes a, lanes b, lanes c) {
#if defined(GART_LANES_AVX512)
  struct table {
    alignas(64) int ab[3][16] = {}, abc[3][16] = {};
    constexpr table() {
      for (int e = 0; e < 48; ++e) {
        ab[e / 16][e % 16] = e / 3 + (e % 3 == 1 ? 16 : 0);
        abc[e / 16][e % 16] = e % 3 == 2 ? 16 + e / 3 : e % 16;
      }
    }
  };
  static constexpr table at;
  for (int k = 0; k < 3 && 16 * k < n; ++k) {
    __m512 const x = _mm512_permutex2var_ps((__m512)a.v, _mm512_load_si512(at.ab[k]), (__m512)b.v);
    __m512 const y = _mm512_permutex2var_ps(x, _mm512_load_si512(at.abc[k]), (__m512)c.v);
    // A store by mask is no source for the loads that follow.
    if (int const left = n - 16 * k; left >= 16)
      _mm512_storeu_ps(out + 16 * k, y);
    else
      _mm512_mask_storeu_ps(out + 16 * k, static_cast<__mmask16>((1u << left) - 1), y);
  }
#else
  for (int l = 0; l < lane_count && 3 * l < n; ++l) {
    float const three[3] = {a.v[l], b.v[l], c.v[l]};
    for (int k = 0; k < 3 && 3 * l + k < n; ++k) out[3 * l + k] = three[k];
  }
#endif
}

/// Four numbers a lane, where they lie together in memory. Lanes 4 r to 4 r + 3 follow one another from `first` + r
/// `stride` (in floats). Lanes that are not in the mask are not touched, and read as zeros.
#if defined(GART_LANES_AVX512)
namespace detail {
// Each of the 4 lanes of a row, four times: a bit a float.
GART_INLINE __mmask16 floats_of_row(lane_mask m, int row) {
  return static_cast<__mmask16>(_pdep_u32(static_cast<u32>(m.m) >> (4 * row), 0x1111u) * 15u);
}
}  // namespace detail

GART_INLINE void write_fours(float* first, std::ptrdiff_t stride, lane_mask m, lanes const (&from)[4]) {
  __m512i const low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  __m512i const low_pairs = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
  __m512i const high = _mm512_add_epi32(low, _mm512_set1_epi32(8));
  __m512i const high_pairs = _mm512_add_epi64(low_pairs, _mm512_set1_epi64(4));
  auto const zip = [](lanes a, lanes b, __m512i how) {
    return _mm512_castps_pd(_mm512_permutex2var_ps((__m512)a.v, how, (__m512)b.v));
  };
  auto const put = [&](int row, __m512d ab, __m512d cd, __m512i how) {
    _mm512_mask_storeu_ps(first + row * stride, detail::floats_of_row(m, row),
                          _mm512_castpd_ps(_mm512_permutex2var_pd(ab, how, cd)));
  };
  __m512d const ab0 = zip(from[0], from[1], low), ab1 = zip(from[0], from[1], high);
  __m512d const cd0 = zip(from[2], from[3], low), cd1 = zip(from[2], from[3], high);
  put(0, ab0, cd0, low_pairs), put(1, ab0, cd0, high_pairs);
  put(2, ab1, cd1, low_pairs), put(3, ab1, cd1, high_pairs);
}

GART_INLINE void read_fours(float const* first, std::ptrdiff_t stride, lane_mask m, lanes (&to)[4]) {
  __m512i const even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  __m512i const even_pairs = _mm512_setr_epi64(0, 2, 4, 6, 8, 10, 12, 14);
  __m512i const odd = _mm512_add_epi32(even, _mm512_set1_epi32(1));
  __m512i const odd_pairs = _mm512_add_epi64(even_pairs, _mm512_set1_epi64(1));
  auto const get = [&](int row) {
    return _mm512_castps_pd(_mm512_maskz_loadu_ps(detail::floats_of_row(m, row), first + row * stride));
  };
  auto const unzip = [](__m512d a, __m512d b, __m512i how) {
    return (lanes::vector)_mm512_permutex2var_ps(_mm512_castpd_ps(a), how, _mm512_castpd_ps(b));
  };
  __m512d const r0 = get(0), r1 = get(1), r2 = get(2), r3 = get(3);
  __m512d const ab0 = _mm512_permutex2var_pd(r0, even_pairs, r1), ab1 = _mm512_permutex2var_pd(r2, even_pairs, r3);
  __m512d const cd0 = _mm512_permutex2var_pd(r0, odd_pairs, r1), cd1 = _mm512_permutex2var_pd(r2, odd_pairs, r3);
  to[0] = unzip(ab0, ab1, even), to[1] = unzip(ab0, ab1, odd);
  to[2] = unzip(cd0, cd1, even), to[3] = unzip(cd0, cd1, odd);
}
#else
GART_INLINE void write_fours(float* first, std::ptrdiff_t stride, lane_mask m, lanes const (&from)[4]) {
  for (u32 left = bits_of(m); left; left &= left - 1) {
    int const l = __builtin_ctz(left);
    float* const at = first + l / 4 * stride + l % 4 * 4;
    for (int k = 0; k < 4; ++k) at[k] = from[k].v[l];
  }
}

/// Reads them back.
GART_INLINE void read_fours(float const* first, std::ptrdiff_t stride, lane_mask m, lanes (&to)[4]) {
  for (lanes& one : to) one = 0.0f;
  for (u32 left = bits_of(m); left; left &= left - 1) {
    int const l = __builtin_ctz(left);
    float const* const at = first + l / 4 * stride + l % 4 * 4;
    for (int k = 0; k < 4; ++k) to[k].v[l] = at[k];
  }
}
#endif

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
