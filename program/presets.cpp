#include "presets.hpp"

#include <algorithm>
#include <cstdio>

namespace gart_cli {

std::vector<preset> const& presets() {
  static std::vector<preset> const all = [] {
    preset exact{"exact", {}}, balanced{"balanced", {}}, fast{"fast", {}};
    // No more of t_min: a ray that ends early leaves what lies behind without a gradient, and training loses by that
    // far more than the image does (docs/tradeoffs.md).
    balanced.render.alpha_min = 0.006f, balanced.render.transmittance_min = 0.001f;
    fast.render.alpha_min = 0.01f, fast.render.transmittance_min = 0.001f;
    return std::vector<preset>{exact, balanced, fast};
  }();
  return all;
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (preset const& p : presets()) names.push_back(p.name);
  return names;
}

preset const& preset_named(std::string const& name) {
  return *std::find_if(presets().begin(), presets().end(), [&](preset const& p) { return p.name == name; });
}

std::string presets_help() {
  std::string text =
      "What is left out for speed; options given besides win. What\nit costs in quality: gart tradeoff, and "
      "docs/tradeoffs.md";
  for (preset const& p : presets()) {
    char knobs[80];
    std::snprintf(knobs, sizeof knobs, ": --alpha-min %.4g --t-min %.4g", p.render.alpha_min,
                  p.render.transmittance_min);
    text += "\n" + p.name + knobs;
  }
  return text;
}

}  // namespace gart_cli
