#pragma once
// Fields of train_options by name (train/option_fields.hpp), for `gart train --set NAME=VALUE,...`.

#include <gart/train/option_fields.hpp>

#include <nlohmann/json.hpp>

#include <map>
#include <string>

namespace gart_cli {

// The option of a field; empty: it is set by --set.
std::string flag_of(gart::option_field const& field);
// Fields that have no option of their own, with their defaults, as lines of the help.
std::string fields_in_help();

// Values of fields by name: what --set gives. config.json keeps them as an object of numbers.
class field_values {
 public:
  field_values() = default;
  // "error.growth_end=0.25,rates.opacity=0.05". usage_error for an unknown name, with the nearest known one, and for a
  // value out of its range.
  static field_values of_text(std::string const& text);
  // An object of numbers, or the text that earlier runs recorded, whose names may be old ones. Errors as of_text.
  static field_values of_json(nlohmann::json const& recorded);

  nlohmann::json json() const { return values_; }
  bool has(std::string const& name) const { return values_.contains(name); }
  void set(std::string const& name, std::string const& value) {
    values_[name] = of_text(name + "=" + value).values_[name];
  }
  void apply(gart::train_options& options) const;

 private:
  void add(std::string const& name, double value);

  std::map<std::string, double> values_;
};

}  // namespace gart_cli
