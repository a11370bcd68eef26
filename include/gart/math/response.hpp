#pragma once
/// \file
/// How the response of a Gaussian falls from its centre: the generalised Gaussians of 3DGRT (Moenne-Loccoz et al.
/// 2024),
///   rho = exp(s |p|^n),  s = -4.5 / 3^n,  n in {1, 2, 3, 4, 5, 8},
/// equal at the centre and at three standard deviations. n = 2 is the Gaussian. A larger n is flatter inside and
/// steeper at the rim. So fewer Gaussians cover a surface, and rays meet fewer of them. n = 1 has a cusp at its centre.
/// Everything else that asks for a Response takes one of these types. A response offers, all of the squared distance
/// |p|^2:
///   response(d2)   rho
///   cutoff(ratio)  the largest |p|^2 with sigma rho >= alpha_min, ratio = sigma / alpha_min >= 1
///   estimated_response(d2)  the same for a gradient, which decides no hit: on a device by its estimate
///   slope(d2)      -2 d ln rho / d |p|^2 = n (4.5 / 3^n) |p|^(n-2), what a hit's moments are weighted with
///                  (math/hit_gradient.hpp); 1 for n = 2
/// All but cutoff take a float or lanes of them. They decide hits: fixed arithmetic (math/arith.hpp), powers by
/// multiplication and square roots, the same bits on every policy. cutoff is within 4e-7 of exact, relatively.
///
/// The cusp of n = 1: towards the centre the gradient's norm goes to a limit, its direction does not. At |p| = 0, where
/// no direction is given, slope is 0. So is the gradient of mean, scale and rotation: the mean over all directions.

#include <gart/math/arith.hpp>
#include <gart/math/lanes.hpp>

#include <concepts>

namespace gart { inline namespace GART_ISA {

/// What takes the place of generalized_gaussian wherever a Response is asked for.
template <class R>
concept response_function = requires(float x) {
  { R::degree } -> std::convertible_to<int>;  // of the Gaussians it is, for files and for densification
  { R::response(x) } -> std::same_as<float>;
  { R::cutoff(x) } -> std::same_as<float>;
  { R::slope(x) } -> std::same_as<float>;
  { R::estimated_response(x) } -> std::same_as<float>;
};

/// A response: exp(s |p|^n), n the degree.
template <int Degree = 2>
struct generalized_gaussian {
  static_assert(Degree == 1 || Degree == 2 || Degree == 3 || Degree == 4 || Degree == 5 || Degree == 8,
                "generalised Gaussians have degree 1, 2, 3, 4, 5 or 8");
  static constexpr int degree = Degree;  ///< n

  /// rho at the squared distance d2.
  template <class F>
  GART_HD GART_INLINE static F response(F d2) {
    return exponential(mul(F(-scale), power(d2)));
  }

  /// The same where it decides no hit.
  template <class F>
  GART_HD GART_INLINE static F estimated_response(F d2) {
    return estimated_exponential_of(mul(F(-scale), power(d2)));
  }

  /// The largest |p|^2 of a hit; ratio: sigma / alpha_min.
  GART_HD GART_INLINE static float cutoff(float ratio) {
    float const level = mul(inverse_scale, logarithm(ratio));  // |p|^n
    if constexpr (Degree == 1)
      return mul(level, level);
    else if constexpr (Degree == 2)
      return level;
    else if constexpr (Degree == 4)
      return square_root(level);
    else if constexpr (Degree == 8)
      return square_root(square_root(level));
    else {
      // The root by logarithms, then one Newton step: the steeper the rim, the more an error of it decides.
      if (level < 1e-30f) return 0.0f;
      float const root = exponential(mul(2.0f / Degree, logarithm(level)));
      float const excess = add(divide(power(root), level), -1.0f);
      return fma(mul(root, -2.0f / Degree), excess, root);
    }
  }

  /// -2 d ln rho / d |p|^2.
  template <class F>
  GART_HD GART_INLINE static F slope(F d2) {
    F const factor = Degree * scale;
    if constexpr (Degree == 1)
      return select(d2 > F(0.0f), factor / square_root(d2), F(0.0f));
    else if constexpr (Degree == 2)
      return F(1.0f);
    else if constexpr (Degree == 3)
      return factor * square_root(d2);
    else if constexpr (Degree == 4)
      return factor * d2;
    else if constexpr (Degree == 5)
      return factor * d2 * square_root(d2);
    else
      return factor * d2 * d2 * d2;
  }

 private:
  static constexpr double exact_scale = [] {
    double s = 4.5;
    for (int k = 0; k < Degree; ++k) s /= 3;
    return s;
  }();
  static constexpr float scale = static_cast<float>(exact_scale);  // -s
  static constexpr float inverse_scale = static_cast<float>(1 / exact_scale);

  // |p|^n
  template <class F>
  GART_HD GART_INLINE static F power(F d2) {
    if constexpr (Degree == 1)
      return square_root(d2);
    else if constexpr (Degree == 2)
      return d2;
    else if constexpr (Degree == 3)
      return mul(d2, square_root(d2));
    else if constexpr (Degree == 4)
      return mul(d2, d2);
    else if constexpr (Degree == 5)
      return mul(mul(d2, d2), square_root(d2));
    else
      return mul(mul(d2, d2), mul(d2, d2));
  }
};
static_assert(response_function<generalized_gaussian<>>);

}}  // namespace gart::GART_ISA
