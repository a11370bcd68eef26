#pragma once
// Sets of approximations to train and render with, chosen from the front that `gart tradeoff` draws
// (docs/tradeoffs.md).

#include <gart/render/options.hpp>

#include <string>
#include <vector>

namespace gart_cli {

struct preset {
  std::string name;
  gart::render_options render;
};

// exact first: the library's defaults.
std::vector<preset> const& presets();
std::vector<std::string> preset_names();
preset const& preset_named(std::string const& name);
// For --help: a line a preset, with what it sets.
std::string presets_help();

}  // namespace gart_cli
