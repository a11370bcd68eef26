#pragma once
// Fields of train_options by name (train/option_fields.hpp), for `gart train --set NAME=VALUE,...`.

#include <gart/train/option_fields.hpp>

#include <string>

namespace gart_cli {

// The option that a field has of its own; empty: it is set by --set.
std::string flag_of(gart::option_field const& field);
// "error.growth_end=0.25,rates.opacity=0.05". usage_error for a name that there is not, with the nearest that there is,
// and for a value out of its range.
void set_fields(gart::train_options& options, std::string const& settings);
// Settings of a run of before, by the names of now.
std::string with_new_names(std::string const& settings);
// Those that have no option of their own, with their defaults, as lines of the help.
std::string fields_in_help();
// Whether they name the field.
bool sets_field(std::string const& settings, std::string const& name);
// With this value in place of the one they may have.
std::string with_field(std::string const& settings, std::string const& name, std::string const& value);

}  // namespace gart_cli
