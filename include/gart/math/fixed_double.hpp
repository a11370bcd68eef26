#pragma once
/// \file
/// Double arithmetic whose rounding is fixed by the source, the counterpart of math/arith.hpp for floats. It serves
/// values in double that decide hits, such as the rays of lenses. Products and sums are rounded one by one on every
/// machine. Formulas are templates over the number, and take double itself where bits do not count.

#include <gart/core/macros.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// A double that compilers do not contract.
struct fixed_double {
  double v = 0;  ///< the number

  fixed_double() = default;
  /// Of any number.
  GART_HD constexpr fixed_double(double x) : v(x) {}
  /// As a plain number.
  GART_HD constexpr explicit operator double() const { return v; }
  /// Rounded.
  GART_HD constexpr explicit operator float() const { return static_cast<float>(v); }

  ///@{
  /// Each rounded once.
#if defined(__CUDA_ARCH__)
  GART_HD friend fixed_double operator+(fixed_double a, fixed_double b) { return __dadd_rn(a.v, b.v); }
  GART_HD friend fixed_double operator-(fixed_double a, fixed_double b) { return __dsub_rn(a.v, b.v); }
  GART_HD friend fixed_double operator*(fixed_double a, fixed_double b) { return __dmul_rn(a.v, b.v); }
  GART_HD friend fixed_double operator/(fixed_double a, fixed_double b) { return __ddiv_rn(a.v, b.v); }
#else
  GART_HD friend fixed_double operator+(fixed_double a, fixed_double b) { return a.v + b.v; }
  GART_HD friend fixed_double operator-(fixed_double a, fixed_double b) { return a.v - b.v; }
  GART_HD friend fixed_double operator*(fixed_double a, fixed_double b) { return a.v * b.v; }
  GART_HD friend fixed_double operator/(fixed_double a, fixed_double b) { return a.v / b.v; }
#endif
  GART_HD friend fixed_double operator-(fixed_double a) { return -a.v; }
  GART_HD friend bool operator<(fixed_double a, fixed_double b) { return a.v < b.v; }
  GART_HD friend bool operator>(fixed_double a, fixed_double b) { return a.v > b.v; }
  ///@}
};

/// Correctly rounded.
GART_HD inline fixed_double square_root(fixed_double a) {
#if defined(__CUDA_ARCH__)
  return __dsqrt_rn(a.v);
#else
  return std::sqrt(a.v);
#endif
}

/// A sine and a cosine.
struct sine_cosine {
  fixed_double sine, cosine;  ///< of one angle
};

/// Of an angle between -pi / 4 and pi / 4: their series, to a rounding.
GART_HD inline sine_cosine small_sine_cosine(fixed_double x) {
  fixed_double const x2 = x * x;
  fixed_double s = 0, c = 0;
  for (int n = 17; n > 1; n -= 2) s = (s + 1.0) * (-x2 / static_cast<double>(n * (n - 1)));
  for (int n = 18; n > 0; n -= 2) c = (c + 1.0) * (-x2 / static_cast<double>(n * (n - 1)));
  return {x + x * s, c + 1.0};
}

/// Of the angle so many quarters of a turn on.
GART_HD inline sine_cosine turned(sine_cosine const& s, double quarters) {
  switch (static_cast<int>(quarters) & 3) {
    case 0:
      return s;
    case 1:
      return {s.cosine, -s.sine};
    case 2:
      return {-s.sine, -s.cosine};
    default:
      return {-s.cosine, s.sine};
  }
}

/// Of `part` / `whole` quarters of a turn, whole numbers or halves. Angles that lie a quarter apart have the same bits
/// in other places and with other signs.
GART_HD inline sine_cosine sine_cosine_of_quarters(double part, double whole) {
  double const quarters = floor(part / whole + 0.5);
  return turned(small_sine_cosine(fixed_double(part - quarters * whole) / fixed_double(whole) * 1.5707963267948966),
                quarters);
}

/// Of an angle of up to a turn.
GART_HD inline sine_cosine sine_cosine_of(fixed_double x) {
  double const quarters = floor(static_cast<double>(x * 0.6366197723675814 + 0.5));
  // pi / 2 in two parts, the first of few digits.
  fixed_double const rest =
      (x - fixed_double(quarters) * 1.5707963267341256) - fixed_double(quarters) * 6.077100506506192e-11;
  return turned(small_sine_cosine(rest), quarters);
}

}}  // namespace gart::GART_ISA
