#pragma once
// Fields of train_options by name, for `gart train --set NAME=VALUE,...`: the rules of docs/training.md, which have no
// option of their own.

#include <gart/train/options.hpp>

#include <string>

namespace gart_cli {

// "error.fill=0.25,rates.opacity=0.05". usage_error for a name that there is not, with those there are, and for a value
// that is no finite number.
void set_fields(gart::train_options& options, std::string const& settings);
// Whether they name the field.
bool sets_field(std::string const& settings, std::string const& name);
// With this value in place of the one they may have.
std::string with_field(std::string const& settings, std::string const& name, std::string const& value);

}  // namespace gart_cli
