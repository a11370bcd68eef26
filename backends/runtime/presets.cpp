#include <gart/core/error.hpp>
#include <gart/runtime/presets.hpp>

namespace gart {

std::vector<preset> const& presets() {
  static std::vector<preset> const all{{"exact"}, {"quick", 13000}};
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
