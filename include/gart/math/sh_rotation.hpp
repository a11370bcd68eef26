#pragma once
/// \file
/// Spherical harmonics turned by any rotation R. The function of coefficients c' has in direction R d the value that
/// the function of c has in d. A matrix of 2 l + 1 rows maps a band of degree l to itself. An entry is the integral
/// over the sphere of Y_j(d) Y_k(R^-1 d). A quadrature that is exact for polynomials of degree 7 takes it, from the
/// basis of math/sh.hpp, to its roundings. Making one takes a few thousand operations, applying it 249 at degree 3.

#include <gart/math/glm.hpp>
#include <gart/math/sh.hpp>

#include <cmath>

namespace gart { inline namespace GART_ISA {

/// A rotation of functions of degree 3 or less.
class sh_rotation {
 public:
  /// `r` is a rotation: orthonormal, no reflection.
  explicit sh_rotation(mat3d const& r) {
    // Gauss and Legendre's four heights, each with eight directions about the axis.
    constexpr double heights[] = {-0.86113631159405258, -0.33998104358485626, 0.33998104358485626, 0.86113631159405258};
    constexpr double weights[] = {0.34785484513745386, 0.65214515486254614, 0.65214515486254614, 0.34785484513745386};
    constexpr double pi = 3.14159265358979323846;
    mat3d back;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) back[i][j] = r[j][i];
    for (int z = 0; z < 4; ++z) {
      double const around = std::sqrt(1 - heights[z] * heights[z]);
      for (int a = 0; a < 8; ++a) {
        vec3d const d(around * std::cos(a * pi / 4), around * std::sin(a * pi / 4), heights[z]);
        sh_basis<3> const here{vec3(d)}, there{vec3(back * d)};
        for (int l = 1; l <= 3; ++l)
          for (int j = 0; j <= 2 * l; ++j)
            for (int k = 0; k <= 2 * l; ++k)
              band_[l][j][k] += weights[z] * pi / 4 * static_cast<double>(here.y[l * l + j]) *
                                static_cast<double>(there.y[l * l + k]);
      }
    }
  }

  /// Turns coefficients [K][3] to `degree` where they stand.
  GART_HD void apply(float* coefficients, int degree) const { turn<false>(coefficients, degree); }
  /// The other way: also from the gradient by turned coefficients to that by those that were turned.
  GART_HD void apply_back(float* coefficients, int degree) const { turn<true>(coefficients, degree); }

 private:
  template <bool Back>
  GART_HD void turn(float* coefficients, int degree) const {
    for (int l = 1; l <= degree; ++l) {
      float* const first = coefficients + 3 * l * l;
      double turned[7][3] = {};
      for (int j = 0; j <= 2 * l; ++j)
        for (int k = 0; k <= 2 * l; ++k) {
          double const entry = Back ? band_[l][k][j] : band_[l][j][k];
          for (int c = 0; c < 3; ++c) turned[j][c] += entry * static_cast<double>(first[3 * k + c]);
        }
      for (int j = 0; j <= 2 * l; ++j)
        for (int c = 0; c < 3; ++c) first[3 * j + c] = static_cast<float>(turned[j][c]);
    }
  }

  double band_[4][7][7] = {};  // of degree l: [to][from]
};

}}  // namespace gart::GART_ISA
