#include "field_names.hpp"

#include "train/train_fields.hpp"

#include <gart/io/dataset.hpp>
#include <gart/render/options.hpp>
#include <gart/runtime/session.hpp>
#include <gart/view/server.hpp>

namespace gart_cli {

// A field that is not in the library does not compile.
#define GART_CLI_FIELD(type, field) (static_cast<void>(&gart::type::field), #type "." #field)

std::vector<field_name> const& field_names() {
  static std::vector<field_name> const names = {
      {GART_CLI_FIELD(train_options, densify), "--densify"},
      {GART_CLI_FIELD(train_options, background), "--background"},
      {GART_CLI_FIELD(train_options, match), "--match"},
      {GART_CLI_FIELD(train_options, exposure), "--exposure"},
      {GART_CLI_FIELD(train_options, vignetting), "--vignetting"},
      {GART_CLI_FIELD(train_options, hit_memory), "--hit-memory"},
      {GART_CLI_FIELD(split_shape, offset), "--set error.split.offset"},
      {GART_CLI_FIELD(split_shape, opacity), "--set error.split.opacity"},
      {GART_CLI_FIELD(render_options, alpha_min), "--alpha-min"},
      {GART_CLI_FIELD(render_options, transmittance_min), "--transmittance-min"},
      {GART_CLI_FIELD(render_options, near), "near"},  // no option: a model's file may say it
      {GART_CLI_FIELD(render_options, max_hits), "--max-hits"},
      {GART_CLI_FIELD(render_options, antialias), "--antialias"},
      {GART_CLI_FIELD(render_options, rebuild_every), "--rebuild-every"},
      {GART_CLI_FIELD(render_options, background), "--background"},
      {GART_CLI_FIELD(dataset_options, downscale), "--downscale"},
      {GART_CLI_FIELD(dataset_options, test_every), "--test-every"},
      {GART_CLI_FIELD(dataset_options, test_split), "--test-split"},
      {GART_CLI_FIELD(dataset_options, photos), "--photos"},
      {GART_CLI_FIELD(dataset_options, masks), "--no-masks"},
      {GART_CLI_FIELD(dataset_options, origin), "origin"},  // no option: it is the model's
      {GART_CLI_FIELD(dataset_options, depth), "--depth-weight"},
      {GART_CLI_FIELD(configuration_request, backend), "--backend"},
      {GART_CLI_FIELD(configuration_request, tracer), "--tracer"},
      {GART_CLI_FIELD(configuration_request, backward), "--backward"},
      {GART_CLI_FIELD(configuration_request, sh_degree), "--sh-degree"},
      {GART_CLI_FIELD(configuration_request, kernel_degree), "--kernel-degree"},
      {GART_CLI_FIELD(configuration_request, hit_format), "--hit-format"},
      {GART_CLI_FIELD(configuration_request, depth), "--depth-weight"},
      {GART_CLI_FIELD(view_server_options, listen), "--listen"},
      {GART_CLI_FIELD(view_server_options, port), "--port"},
      {GART_CLI_FIELD(view_server_options, allowed_hosts), "--allow-host"},
  };
  return names;
}

#undef GART_CLI_FIELD

std::string option_of(std::string_view field) {
  for (field_name const& n : field_names())
    if (n.field == field) return std::string(n.option);
  static constexpr std::string_view of_training = "train_options.";
  if (field.substr(0, of_training.size()) != of_training) return "";
  gart::option_field const* const found = gart::find_option_field(field.substr(of_training.size()));
  return !found ? "" : flag_of(*found).empty() ? "--set " + std::string(found->name) : flag_of(*found);
}

std::string in_options(std::string_view message, std::function<bool(std::string const&)> const& has) {
  static constexpr std::string_view of_a_word = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.";
  static constexpr std::string_view equals = " = ";
  std::string shown;
  while (!message.empty()) {
    std::string_view const word = message.substr(0, message.find_first_not_of(of_a_word));
    if (word.empty()) {
      shown += message.front();
      message.remove_prefix(1);
      continue;
    }
    message.remove_prefix(word.size());
    // The point that ends a sentence is no part of a name.
    std::string_view const name = word.substr(0, word.find_last_not_of('.') + 1);
    std::string const found = option_of(name);
    if (found.starts_with("--") && has && !has(found.substr(0, found.find(' ')))) shown += "gart train ";
    shown += found.empty() ? name : std::string_view(found);
    shown += word.substr(name.size());
    if (!found.empty() && name == word && message.substr(0, equals.size()) == equals) {
      shown += ' ';
      message.remove_prefix(equals.size());
    }
  }
  return shown;
}

}  // namespace gart_cli
