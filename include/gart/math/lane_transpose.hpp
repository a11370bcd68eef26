#pragma once
/// \file
/// Numbers and lanes (math/lanes.hpp) change places: sums over all lanes, and numbers of a lane that lie together in
/// memory. Each has a form for the registers of AVX-512, one for those of AVX2, and one that names no machine.

#include <gart/math/lanes.hpp>

#include <type_traits>

#if !defined(__CUDACC__)

namespace gart { inline namespace GART_ISA {

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
#elif defined(__AVX2__)
  // Halves are added, then four numbers' quarters change places with them.
  for (int k = 0; k < 16; k += 4) {
    __m128 x[4];
    for (int i = 0; i < 4; ++i) {
      __m256 const one = k + i < N ? (__m256)a[k + i < N ? k + i : 0].v : _mm256_setzero_ps();
      x[i] = _mm_add_ps(_mm256_castps256_ps128(one), _mm256_extractf128_ps(one, 1));
    }
    __m128 const p = _mm_add_ps(_mm_unpacklo_ps(x[0], x[1]), _mm_unpackhi_ps(x[0], x[1]));
    __m128 const q = _mm_add_ps(_mm_unpacklo_ps(x[2], x[3]), _mm_unpackhi_ps(x[2], x[3]));
    _mm_storeu_ps(out + k, _mm_add_ps(_mm_movelh_ps(p, q), _mm_movehl_ps(q, p)));
  }
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
#if defined(__AVX2__)
  if (n >= 3 * lane_count) {
    // Of each half: a0 b0 c0 a1, b1 c1 a2 b2, c2 a3 b3 c3.
    __m256 const x = (__m256)a.v, y = (__m256)b.v, z = (__m256)c.v;
    __m256 const zx_low = _mm256_unpacklo_ps(z, x), yz_low = _mm256_unpacklo_ps(y, z);
    __m256 const xy_high = _mm256_unpackhi_ps(x, y), zx_high = _mm256_unpackhi_ps(z, x);
    __m256 const three[3] = {_mm256_shuffle_ps(_mm256_unpacklo_ps(x, y), zx_low, _MM_SHUFFLE(3, 0, 1, 0)),
                             _mm256_shuffle_ps(yz_low, xy_high, _MM_SHUFFLE(1, 0, 3, 2)),
                             _mm256_shuffle_ps(zx_high, _mm256_unpackhi_ps(y, z), _MM_SHUFFLE(3, 2, 3, 0))};
    for (int k = 0; k < 3; ++k) {
      _mm_storeu_ps(out + 4 * k, _mm256_castps256_ps128(three[k]));
      _mm_storeu_ps(out + 12 + 4 * k, _mm256_extractf128_ps(three[k], 1));
    }
    return;
  }
#endif
  for (int l = 0; l < lane_count && 3 * l < n; ++l) {
    float const three[3] = {a.v[l], b.v[l], c.v[l]};
    for (int k = 0; k < 3 && 3 * l + k < n; ++k) out[3 * l + k] = three[k];
  }
#endif
}

/// Four numbers a lane to memory: from `first` + 4 places[l] on, for the lanes of the mask.
GART_INLINE void scatter_fours(float* first, lane_words places, lane_mask m, lanes const (&from)[4]) {
  u32 const bits = bits_of(m);
#if defined(GART_LANES_AVX512)
  // Numbers and lanes change places; then each lane's four are a store. Lanes that are not in the mask go astray: a
  // branch each would be predicted badly.
  __m512i const low = _mm512_setr_epi32(0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23);
  __m512i const low_pairs = _mm512_setr_epi64(0, 8, 1, 9, 2, 10, 3, 11);
  __m512i const high = _mm512_add_epi32(low, _mm512_set1_epi32(8));
  __m512i const high_pairs = _mm512_add_epi64(low_pairs, _mm512_set1_epi64(4));
  auto const zip = [](lanes a, lanes b, __m512i how) {
    return _mm512_castps_pd(_mm512_permutex2var_ps((__m512)a.v, how, (__m512)b.v));
  };
  alignas(64) float astray[4];
  alignas(64) u32 to[lane_count];
  _mm512_store_si512(to, (__m512i)places);
  auto const put = [&]<int Row>(std::integral_constant<int, Row>, __m512d ab, __m512d cd, __m512i how) {
    __m512 const four = _mm512_castpd_ps(_mm512_permutex2var_pd(ab, how, cd));
    auto const one = [&]<int K>(std::integral_constant<int, K>) {
      constexpr int l = 4 * Row + K;
      _mm_storeu_ps(bits >> l & 1 ? first + std::size_t{4} * to[l] : astray, _mm512_maskz_extractf32x4_ps(15, four, K));
    };
    one(std::integral_constant<int, 0>{}), one(std::integral_constant<int, 1>{});
    one(std::integral_constant<int, 2>{}), one(std::integral_constant<int, 3>{});
  };
  __m512d const ab0 = zip(from[0], from[1], low), ab1 = zip(from[0], from[1], high);
  __m512d const cd0 = zip(from[2], from[3], low), cd1 = zip(from[2], from[3], high);
  put(std::integral_constant<int, 0>{}, ab0, cd0, low_pairs);
  put(std::integral_constant<int, 1>{}, ab0, cd0, high_pairs);
  put(std::integral_constant<int, 2>{}, ab1, cd1, low_pairs);
  put(std::integral_constant<int, 3>{}, ab1, cd1, high_pairs);
#elif defined(__AVX2__)
  __m256 const a = (__m256)from[0].v, b = (__m256)from[1].v, c = (__m256)from[2].v, d = (__m256)from[3].v;
  __m256 const ab_low = _mm256_unpacklo_ps(a, b), ab_high = _mm256_unpackhi_ps(a, b);
  __m256 const cd_low = _mm256_unpacklo_ps(c, d), cd_high = _mm256_unpackhi_ps(c, d);
  // Of lanes k and k + 4.
  __m256 const fours[4] = {_mm256_shuffle_ps(ab_low, cd_low, 0x44), _mm256_shuffle_ps(ab_low, cd_low, 0xee),
                           _mm256_shuffle_ps(ab_high, cd_high, 0x44), _mm256_shuffle_ps(ab_high, cd_high, 0xee)};
  alignas(16) float astray[4];
  for (int k = 0; k < 4; ++k) {
    _mm_storeu_ps(bits >> k & 1 ? first + std::size_t{4} * places[k] : astray, _mm256_castps256_ps128(fours[k]));
    _mm_storeu_ps(bits >> k & 16 ? first + std::size_t{4} * places[k + 4] : astray, _mm256_extractf128_ps(fours[k], 1));
  }
#else
  for (u32 left = bits; left; left &= left - 1) {
    int const l = __builtin_ctz(left);
    for (int k = 0; k < 4; ++k) first[std::size_t{4} * places[l] + static_cast<std::size_t>(k)] = from[k].v[l];
  }
#endif
}

/// Reads four numbers a lane that lie together in memory: lanes 4 r to 4 r + 3 one after another from `first` +
/// r `stride` (in floats). Lanes that are not in the mask read as zeros.
#if defined(GART_LANES_AVX512)
namespace detail {
// Each of the 4 lanes of a row, four times: a bit a float.
GART_INLINE __mmask16 floats_of_row(lane_mask m, int row) {
  return static_cast<__mmask16>(_pdep_u32(static_cast<u32>(m.m) >> (4 * row), 0x1111u) * 15u);
}
}  // namespace detail

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
#elif defined(__AVX2__)
GART_INLINE void read_fours(float const* first, std::ptrdiff_t stride, lane_mask m, lanes (&to)[4]) {
  auto const column = [&]<int K>(std::integral_constant<int, K>) {
    __m256i const twice = _mm256_shuffle_epi32((__m256i)m.m, 0x55 * K);
    float const* const above = first + 4 * K;
    return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_maskload_ps(above, _mm256_castsi256_si128(twice))),
                                _mm_maskload_ps(above + stride, _mm256_extracti128_si256(twice, 1)), 1);
  };
  __m256 const a = column(std::integral_constant<int, 0>{}), b = column(std::integral_constant<int, 1>{});
  __m256 const c = column(std::integral_constant<int, 2>{}), d = column(std::integral_constant<int, 3>{});
  __m256 const ab_low = _mm256_unpacklo_ps(a, b), ab_high = _mm256_unpackhi_ps(a, b);
  __m256 const cd_low = _mm256_unpacklo_ps(c, d), cd_high = _mm256_unpackhi_ps(c, d);
  to[0] = (lanes::vector)_mm256_shuffle_ps(ab_low, cd_low, 0x44);
  to[1] = (lanes::vector)_mm256_shuffle_ps(ab_low, cd_low, 0xee);
  to[2] = (lanes::vector)_mm256_shuffle_ps(ab_high, cd_high, 0x44);
  to[3] = (lanes::vector)_mm256_shuffle_ps(ab_high, cd_high, 0xee);
}
#else
GART_INLINE void read_fours(float const* first, std::ptrdiff_t stride, lane_mask m, lanes (&to)[4]) {
  for (lanes& one : to) one = 0.0f;
  for (u32 left = bits_of(m); left; left &= left - 1) {
    int const l = __builtin_ctz(left);
    float const* const at = first + l / 4 * stride + l % 4 * 4;
    for (int k = 0; k < 4; ++k) to[k].v[l] = at[k];
  }
}
#endif

}}  // namespace gart::GART_ISA

#endif
