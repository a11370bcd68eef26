#pragma once
/// \file
/// The window and constants of SSIM, the same as in the systems that gart is compared with. Source: Wang et al., Image
/// Quality Assessment: From Error Visibility to Structural Similarity, 2004. The window is an 11 x 11 Gaussian of
/// deviation 1.5, separable, with zeros outside the image. For images in [0, 1], C1 = 0.01^2 and C2 = 0.03^2.

#include <gart/core/macros.hpp>

/// The window of SSIM.
namespace gart { inline namespace GART_ISA { namespace ssim_window {

inline constexpr int radius = 5;                             ///< pixels
inline constexpr int taps = 2 * radius + 1;                  ///< of a row or column of the window
inline constexpr double c1 = 0.01 * 0.01, c2 = 0.03 * 0.03;  ///< the constants

/// Weight of tap k: exp(-(k - 5)^2 / (2 * 1.5^2)), normalised to the sum 1.
GART_HD constexpr double weight(int k) {
  constexpr double half[6] = {0.00102838008447911, 0.007598758135239185, 0.03600077212843083,
                              0.10936068950970002, 0.2130055377112537,   0.26601172486179436};
  return half[k <= radius ? k : 2 * radius - k];
}

}}}  // namespace gart::GART_ISA::ssim_window
