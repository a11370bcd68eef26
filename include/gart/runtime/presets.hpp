#pragma once
// Sets of approximations to train and render with, chosen from the front that `gart tradeoff` draws
// (docs/tradeoffs.md).
// Errors: preset_named throws invalid_argument, naming those there are.

#include <gart/render/options.hpp>

#include <string>
#include <vector>

namespace gart {

struct preset {
  std::string name;
  float alpha_min = render_options{}.alpha_min;
  float transmittance_min = render_options{}.transmittance_min;

  void apply(approximation_options& to) const { to.alpha_min = alpha_min, to.transmittance_min = transmittance_min; }
};

// exact first: the library's defaults.
std::vector<preset> const& presets();
std::vector<std::string> preset_names();
preset const& preset_named(std::string const& name);

}  // namespace gart
