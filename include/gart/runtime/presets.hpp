#pragma once
/// \file
/// How long to train, by name (docs/training.md).
/// Errors: preset_named throws invalid_argument, naming those there are.

#include <string>
#include <vector>

namespace gart {

/// How long to train.
struct preset {
  std::string name;    ///< how it is asked for
  int iterations = 0;  ///< steps of a training; 0: as many as without it
};

/// exact first: the library's defaults.
std::vector<preset> const& presets();
/// In the order of presets().
std::vector<std::string> preset_names();
/// The one of that name.
preset const& preset_named(std::string const& name);

}  // namespace gart
