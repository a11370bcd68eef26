#pragma once
/// \file
/// What speed may cost: sets of approximations to train and render with, chosen from the front that `gart tradeoff`
/// draws (docs/performance.md), and a training of fewer steps (docs/training.md).
/// Errors: preset_named throws invalid_argument, naming those there are.

#include <gart/render/options.hpp>

#include <string>
#include <vector>

namespace gart {

/// A set of approximations, and how long to train.
struct preset {
  std::string name;                                              ///< how it is asked for
  float alpha_min = render_options{}.alpha_min;                  ///< a Gaussian is hit where sigma * rho >= alpha_min
  float transmittance_min = render_options{}.transmittance_min;  ///< a ray ends after the hit that brings T below this
  int iterations = 0;                                            ///< steps of a training; 0: as many as without it

  /// Whether it leaves anything out of an image.
  bool approximates() const {
    render_options const exact;
    return alpha_min != exact.alpha_min || transmittance_min != exact.transmittance_min;
  }
  /// Sets those of the options that it has.
  void apply(approximation_options& to) const { to.alpha_min = alpha_min, to.transmittance_min = transmittance_min; }
};

/// exact first: the library's defaults.
std::vector<preset> const& presets();
/// In the order of presets().
std::vector<std::string> preset_names();
/// The one of that name.
preset const& preset_named(std::string const& name);

}  // namespace gart
