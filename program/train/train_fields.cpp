#include "train_fields.hpp"

#include "commands.hpp"

#include <gart/core/words.hpp>
#include <gart/train/option_fields.hpp>

#include <cmath>
#include <cstdlib>
#include <sstream>
#include <string_view>
#include <utility>

namespace gart_cli {

std::string flag_of(gart::option_field const& field) {
  static constexpr std::pair<std::string_view, std::string_view> flags[] = {
      {"iterations", "--iterations"},
      {"max_gaussians", "--max-gaussians"},
      {"random_points", "--points"},
      {"initial_opacity", "--init-opacity"},
      {"initial_scale", "--init-scale"},
      {"batch", "--batch"},
      {"seed", "--seed"},
      {"refine_poses", "--refine-poses"},
      {"refine_lens", "--refine-lens"},
      {"depth_weight", "--depth-weight"},
      {"render.rebuild_every", "--rebuild-every"},
      {"render.alpha_min", "--alpha-min"},
      {"render.transmittance_min", "--transmittance-min"},
      {"render.max_hits", "--max-hits"},
      {"check_finite", "--check-finite"}};
  for (auto const& [name, flag] : flags)
    if (name == field.name) return std::string(flag);
  return "";
}

namespace {

// Names in the config.json of earlier runs.
constexpr std::pair<std::string_view, std::string_view> renamed[] = {
    // old, new
    {"error.split.share", "error.split.offset"},
    {"error.least_budget", "error.min_gaussians"},
    {"error.pixels_each", "error.pixels_per_gaussian"},
    {"error.fill", "error.growth_end"},
    {"antialias", "render.antialias"},
    {"rates.settle_late", "rates.decay_start_short"},
    {"rates.settled", "rates.final_scale"}};

std::string new_name(std::string const& name) {
  for (auto const& [old, now] : renamed)
    if (old == name) return std::string(now);
  return name;
}

// f(name, value) for each NAME=VALUE of a list; NaN where the value is no number.
template <class F>
void each_of(std::string const& text, F const& f) {
  std::istringstream list(text);
  for (std::string one; std::getline(list, one, ',');) {
    std::size_t const equals = one.find('=');
    std::string const value = equals == std::string::npos ? "" : one.substr(equals + 1);
    char* end = nullptr;
    double const number = std::strtod(value.c_str(), &end);
    bool const is_number = !value.empty() && *end == '\0';
    f(one.substr(0, equals), is_number ? number : std::nan(""));
  }
}

}  // namespace

void field_values::add(std::string const& name, double value) {
  gart::option_field const* const field = gart::find_option_field(name);
  if (!field) {
    std::vector<std::string> names;
    for (gart::option_field const& f : gart::option_fields) names.emplace_back(f.name);
    std::string const now = new_name(name);
    throw usage_error("--set " + name + ": no such field" +
                      (now != name ? "; it is " + now + " now" : gart::did_you_mean(name, names)));
  }
  if (!std::isfinite(value)) throw usage_error("--set " + name + ": a finite number belongs after " + name + "=");
  if (value < field->low || value > field->high)
    throw usage_error("--set " + name + "=" + gart::short_number(value) + ": a number from " +
                      gart::short_number(field->low) + " to " + gart::short_number(field->high) + " belongs after " +
                      name + "=");
  values_[name] = value;
}

field_values field_values::of_text(std::string const& text) {
  field_values all;
  each_of(text, [&](std::string const& name, double value) {
    if (gart::option_field const* const field = gart::find_option_field(name)) {
      if (std::string const flag = flag_of(*field); !flag.empty())
        throw usage_error("--set " + name + ": has an option of its own, " + flag);
      if (field->whole() && std::isfinite(value) && value != std::floor(value))
        throw usage_error("--set " + name + "=" + gart::short_number(value) + ": a whole number belongs after " + name +
                          "=");
    }
    all.add(name, value);
  });
  return all;
}

field_values field_values::of_json(nlohmann::json const& recorded) {
  field_values all;
  if (recorded.is_string())
    each_of(recorded.get<std::string>(),
            [&](std::string const& name, double value) { all.add(new_name(name), value); });
  else if (!recorded.is_object())
    throw usage_error("--set: an object of numbers belongs there");
  else
    for (auto const& [name, value] : recorded.items())
      all.add(new_name(name), value.is_number() ? value.get<double>() : std::nan(""));
  return all;
}

void field_values::apply(gart::train_options& options) const {
  for (auto const& [name, value] : values_) gart::find_option_field(name)->set(options, value);
}

std::string fields_in_help() {
  gart::train_options const defaults;
  std::string text = "\nRules, by --set NAME=VALUE,...:\n";
  for (gart::option_field const& f : gart::option_fields) {
    if (!flag_of(f).empty()) continue;
    std::string const name = "  " + std::string(f.name) + "=" + gart::short_number(f.get(defaults));
    text += name + std::string(name.size() < 34 ? 34 - name.size() : 1, ' ') + std::string(f.help) + "\n";
  }
  return text;
}

}  // namespace gart_cli
