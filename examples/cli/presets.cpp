#include "presets.hpp"

#include <algorithm>
#include <cstdio>

namespace gart_cli {

std::vector<preset> const& presets() {
  static std::vector<preset> const all = [] {
    // The quickstart model and capture on a CPU: bench/results/tradeoff_quickstart.json, presets_quickstart.json; full
    // size on a GPU: presets_lego.json, presets_tandt_train.json.
    preset exact{"exact",
                 {},
                 "image at 102 dB to the reference in double, gradient to\n  0.05%; trained: 29.28 dB in 9 s;\n  full "
                 "size: lego 35.84, tandt_train 23.16 dB"};
    preset balanced{"balanced",
                    {},
                    "1.2 times as fast; 53 dB, 9%; trained: 29.31 dB in 9 s;\n  full size: 35.91, 23.11 dB"};
    preset fast{
        "fast", {}, "1.5 times as fast; 45 dB, 18%; trained: 29.33 dB in 7 s;\n  full size: 35.89, 22.62 dB"};
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
      "What is left out for speed; options given besides win.\nMeasured on the quickstart's model and capture, 2 "
      "cores;\nfull size: trained for 7,000 steps on an H200:";
  for (preset const& p : presets()) {
    char knobs[80];
    std::snprintf(knobs, sizeof knobs, ": --alpha-min %.4g --t-min %.4g;\n  ", p.render.alpha_min,
                  p.render.transmittance_min);
    text += "\n" + p.name + knobs + p.cost;
  }
  return text;
}

}  // namespace gart_cli
