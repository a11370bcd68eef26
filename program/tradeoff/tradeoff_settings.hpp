#pragma once
// The table of `gart tradeoff`: every knob that buys speed with accuracy, each turned alone, and a few together.

#include <gart/io/splat_file.hpp>
#include <gart/runtime/session.hpp>

#include <string>
#include <vector>

namespace gart_cli {

// All that decides how a view is traced.
struct configuration {
  gart::configuration_request configuration;
  gart::render_options render;
  int shrink = 1;      // traced at 1 / shrink of the width and the height, shown at full size
  std::string format;  // ending of the file that the model has gone through; empty: none
  gart::splat_packing packing;
};

struct setting {
  std::string knob, value;
  configuration use;
  // A value that names several knobs itself stands alone.
  std::string name() const {
    return value.empty() ? knob : value.find('=') != std::string::npos ? value : knob + "=" + value;
  }
};

// The first is `exact` itself; values that it already has are left out.
std::vector<setting> settings_of(configuration const& exact);

// The settings whose knob or name is in `wanted`, and always the first; all if it is empty. Throws usage_error for a
// word that is neither.
std::vector<setting> selected_settings(std::vector<setting> const& all, std::vector<std::string> const& wanted);

}  // namespace gart_cli
