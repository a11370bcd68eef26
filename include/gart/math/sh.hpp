#pragma once
/// \file
/// Real spherical harmonics to degree 3 with the signs and order of the 3DGS files. Colour is max(0, 0.5 + sum_k c_k
/// Y_k(d)), d the unit direction of the ray. A sum that is no finite number is black, like a negative one. One broken
/// Gaussian must not spoil every ray that meets it.

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>
#include <gart/math/arith.hpp>
#include <gart/math/glm.hpp>
#include <gart/math/lanes.hpp>

namespace gart { inline namespace GART_ISA {

/// The first function, which no direction changes: 1 / (2 sqrt(pi)).
inline constexpr double sh_constant = 0.28209479177387814;

/// Of one direction, or of one a lane.
template <int Degree, class F = float>
struct sh_basis {
  static constexpr int size = (Degree + 1) * (Degree + 1);  ///< functions
  F y[size];                                                ///< their values

  sh_basis() = default;
  /// At a unit direction. The arithmetic is fixed (math/arith.hpp). A compiler that contracts products and sums does so
  /// differently in each kernel. Colours of tracers would differ in the last bits.
  GART_HD GART_INLINE explicit sh_basis(vec3_of<F> const& d) {
    y[0] = static_cast<float>(sh_constant);
    if constexpr (Degree >= 1) {
      y[1] = mul(F(-0.4886025119029199f), d.y);
      y[2] = mul(F(0.4886025119029199f), d.z);
      y[3] = mul(F(-0.4886025119029199f), d.x);
    }
    F const xx = mul(d.x, d.x), yy = mul(d.y, d.y), zz = mul(d.z, d.z);
    if constexpr (Degree >= 2) {
      y[4] = mul(mul(F(1.0925484305920792f), d.x), d.y);
      y[5] = mul(mul(F(-1.0925484305920792f), d.y), d.z);
      y[6] = mul(F(0.31539156525252005f), add(add(mul(F(2.0f), zz), -xx), -yy));
      y[7] = mul(mul(F(-1.0925484305920792f), d.x), d.z);
      y[8] = mul(F(0.5462742152960396f), add(xx, -yy));
    }
    if constexpr (Degree >= 3) {
      F const four_zz = add(add(mul(F(4.0f), zz), -xx), -yy);
      y[9] = mul(mul(F(-0.5900435899266435f), d.y), add(mul(F(3.0f), xx), -yy));
      y[10] = mul(mul(mul(F(2.890611442640554f), d.x), d.y), d.z);
      y[11] = mul(mul(F(-0.4570457994644658f), d.y), four_zz);
      y[12] = mul(mul(F(0.3731763325901154f), d.z), add(add(mul(F(2.0f), zz), -mul(F(3.0f), xx)), -mul(F(3.0f), yy)));
      y[13] = mul(mul(F(-0.4570457994644658f), d.x), four_zz);
      y[14] = mul(mul(F(1.445305721320277f), d.z), add(xx, -yy));
      y[15] = mul(mul(F(-0.5900435899266435f), d.x), add(xx, -mul(F(3.0f), yy)));
    }
  }

  /// Before the clamp at zero.
  GART_HD GART_INLINE vec3_of<F> unclamped(float const (&coefficients)[3 * size]) const {
    return unclamped(coefficients, size);
  }
  /// The first bands alone.
  GART_HD GART_INLINE vec3_of<F> unclamped(float const* coefficients, int bands) const {
#if !defined(__CUDACC__) && defined(__AVX2__) && defined(GART_FUSED)
    // A channel is a lane, of four that are read. The last band's fourth would lie past the row.
    if constexpr (std::is_same_v<F, float>) {
      int const all = bands < size ? bands : size;
      __m128 sum = _mm_set1_ps(0.5f);
#pragma GCC unroll 16
      for (int k = 0; k < size; ++k) {
        if (k + 1 >= all) break;
        sum = _mm_fmadd_ps(_mm_set1_ps(y[k]), _mm_loadu_ps(coefficients + 3 * k), sum);
      }
      float const* const last = coefficients + 3 * (all - 1);
      sum = _mm_fmadd_ps(_mm_set1_ps(y[all - 1]), _mm_setr_ps(last[0], last[1], last[2], 0), sum);
      return {sum[0], sum[1], sum[2]};
    }
#endif
    F r = 0.5f, g = 0.5f, b = 0.5f;
    GART_UNROLL
    for (int k = 0; k < size; ++k) {
      if (k >= bands) break;
      r = fma(y[k], F(coefficients[3 * k]), r);
      g = fma(y[k], F(coefficients[3 * k + 1]), g);
      b = fma(y[k], F(coefficients[3 * k + 2]), b);
    }
    return {r, g, b};
  }
};

/// The coefficients of one Gaussian, [size][3] from `from`; those above the active degree as zero. A schedule raises
/// the degree while the storage stays, and loops over bands stay straight. Rows of a multiple of 16 bytes are read as
/// such.
template <int Degree>
struct sh_row {
  static constexpr int floats = 3 * sh_basis<Degree>::size;  ///< of a Gaussian
  float v[floats];                                           ///< the coefficients

  /// Reads the bands up to a degree.
  GART_HD GART_INLINE sh_row(float const* from, int active_degree) {
    int const active = 3 * (active_degree + 1) * (active_degree + 1);
    if constexpr (floats % 4 == 0) {
      GART_UNROLL
      for (int k = 0; k < floats; k += 4) {
        quad q{};
        if (k < active) q = *reinterpret_cast<quad const*>(from + k);
        GART_UNROLL
        for (int i = 0; i < 4; ++i) v[k + i] = k + i < active ? q.v[i] : 0.0f;
      }
    } else {
      GART_UNROLL
      for (int k = 0; k < floats; ++k) v[k] = k < active ? from[k] : 0.0f;
    }
  }
};

/// Positive and finite.
template <class F>
GART_HD GART_INLINE auto shows(F channel) {
  return both(channel > F(0.0f), channel <= F(3.402823466e38f));
}

/// The colour a hit shows.
template <class F = float>
GART_HD GART_INLINE vec3_of<F> clamped_color(vec3_of<F> const& c) {
  F const zero = 0.0f;
  return {select(shows(c.x), c.x, zero), select(shows(c.y), c.y, zero), select(shows(c.z), c.z, zero)};
}

}}  // namespace gart::GART_ISA
