#include <gart/core/error.hpp>
#include <gart/runtime/presets.hpp>

namespace gart {

std::vector<preset> const& presets() {
  // No more of transmittance_min: a ray that ends early leaves what lies behind without a gradient, and training loses
  // by that far more than the image does (docs/performance.md).
  static std::vector<preset> const all{
      {"exact"}, {.name = "quick", .iterations = 13000}, {"balanced", 0.006f, 0.001f}, {"fast", 0.01f, 0.001f}};
  return all;
}

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (preset const& p : presets()) names.push_back(p.name);
  return names;
}

preset const& preset_named(std::string const& name) {
  std::string names;
  for (preset const& p : presets()) {
    if (p.name == name) return p;
    names += (names.empty() ? "" : ", ") + p.name;
  }
  throw invalid_argument("there is no preset '" + name + "'; there are " + names);
}

}  // namespace gart
