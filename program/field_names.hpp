#pragma once
// The library's errors name settings by their fields (core/error.hpp), the program's user knows options: the one table
// between them.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace gart_cli {

struct field_name {
  std::string_view field;   // "train_options.max_gaussians"
  std::string_view option;  // "--max-gaussians"
};

// Of fields that are not in the table of train/option_fields.hpp, which has its own.
std::vector<field_name> const& field_names();
// "train_options.seed" to "--seed"; empty for an unknown field.
std::string option_of(std::string_view field);

// A message of the library with each field as its option, and `field = value` as `--option value`. One that the command
// has not, by has("--option"), is shown as of gart train, which left the model.
std::string in_options(std::string_view message, std::function<bool(std::string const&)> const& has = {});

}  // namespace gart_cli
