#include "train_fields.hpp"

#include "commands.hpp"

#include <gart/core/suggestion.hpp>
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

// Names that runs of before have in their config.json.
constexpr std::pair<std::string_view, std::string_view> renamed[] = {
    // old, new
    {"error.split.share", "error.split.offset"},
    {"error.least_budget", "error.min_gaussians"},
    {"error.pixels_each", "error.pixels_per_gaussian"},
    {"error.fill", "error.growth_end"},
    {"antialias", "render.antialias"},
    {"rates.settle_late", "rates.decay_start_short"},
    {"rates.settled", "rates.final_scale"}};

}  // namespace

std::string with_new_names(std::string const& settings) {
  std::string text;
  std::istringstream list(settings);
  for (std::string one; std::getline(list, one, ',');) {
    std::size_t const end = one.find('=');
    for (auto const& [old, now] : renamed)
      if (end != one.npos && one.substr(0, end) == old) {
        one.replace(0, end, now);
        break;
      }
    text += (text.empty() ? "" : ",") + one;
  }
  return text;
}

void set_fields(gart::train_options& o, std::string const& settings) {
  std::istringstream list(settings);
  for (std::string one; std::getline(list, one, ',');) {
    std::size_t const equals = one.find('=');
    std::string const name = one.substr(0, equals), value = equals == std::string::npos ? "" : one.substr(equals + 1);
    gart::option_field const* const field = gart::find_option_field(name);
    if (!field) {
      std::vector<std::string> names;
      for (gart::option_field const& f : gart::option_fields) names.emplace_back(f.name);
      std::string const now = with_new_names(one);
      throw usage_error("--set " + one + ": no such field" +
                        (now != one ? "; it is " + now + " now" : gart::did_you_mean(name, names)) +
                        " (see gart train --help-all)");
    }
    char* end = nullptr;
    double const number = std::strtod(value.c_str(), &end);
    if (value.empty() || *end != '\0' || !std::isfinite(number))
      throw usage_error("--set " + one + ": a finite number belongs after " + name + "= (see gart train --help-all)");
    if (number < field->low || number > field->high)
      throw usage_error("--set " + one + ": a number from " + gart::short_number(field->low) + " to " +
                        gart::short_number(field->high) + " belongs after " + name + "= (see gart train --help-all)");
    field->set(o, number);
  }
}

std::string fields_in_help() {
  gart::train_options const defaults;
  std::string text = "\nRules, by --set NAME=VALUE,...:\n";
  for (gart::option_field const& f : gart::option_fields) {
    if (!flag_of(f).empty()) continue;
    std::string const name = "  " + std::string(f.name) + "=" + gart::short_number(static_cast<float>(f.get(defaults)));
    text += name + std::string(name.size() < 34 ? 34 - name.size() : 1, ' ') + std::string(f.help) + "\n";
  }
  return text;
}

std::string with_field(std::string const& settings, std::string const& name, std::string const& value) {
  std::string others;
  std::istringstream list(settings);
  for (std::string one; std::getline(list, one, ',');)
    if (one.substr(0, one.find('=')) != name) others += "," + one;
  return name + "=" + value + others;
}

bool sets_field(std::string const& settings, std::string const& name) {
  return ("," + settings).find("," + name + "=") != std::string::npos;
}

}  // namespace gart_cli
