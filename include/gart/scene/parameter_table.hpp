#pragma once
/// \file
/// The table of a scene's parameter arrays (scene/gaussians.hpp). Sizes, Adam and its rates, checks, rows and
/// checkpoints walk it. A new array is a line here, a member of the types that hold them, and a rate (optim/adam.hpp).

#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

namespace gart {

/// K: coefficients a channel of spherical harmonics to this degree.
GART_HD constexpr int sh_coefficients(int degree) { return (degree + 1) * (degree + 1); }

/// A line of the table.
struct parameter_array {
  char const* name;   ///< of the member, and in checkpoints
  char const* title;  ///< in messages
  int number;         ///< in the table
  index_t floats;     ///< a Gaussian; 0: three for each coefficient of the spherical harmonics

  /// Floats a Gaussian.
  GART_HD constexpr index_t width(int sh_degree) const {
    return floats ? floats : 3 * static_cast<index_t>(sh_coefficients(sh_degree));
  }
};

/// Lines of the table.
inline constexpr int parameter_arrays = 5;
///@{
/// The lines of the means and of the colours.
inline constexpr int mean_array = 0, sh_array = parameter_arrays - 1;
///@}

/// Calls f(parameter_array, set.member...) for each array, in order, with that member of every set. A set has the
/// members mean, log_scale, quaternion, opacity and sh.
GART_KERNEL constexpr void for_each_array(auto&& f, auto&&... sets) {
  f(parameter_array{"mean", "mean", mean_array, 3}, sets.mean...);
  f(parameter_array{"log_scale", "log-scale", 1, 3}, sets.log_scale...);
  f(parameter_array{"quaternion", "quaternion", 2, 4}, sets.quaternion...);
  f(parameter_array{"opacity", "opacity", 3, 1}, sets.opacity...);
  f(parameter_array{"sh", "SH", sh_array, 0}, sets.sh...);
}

}  // namespace gart
