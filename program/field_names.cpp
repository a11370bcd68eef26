#include "field_names.hpp"

#include <gart/io/dataset.hpp>
#include <gart/render/options.hpp>
#include <gart/runtime/session.hpp>
#include <gart/train/options.hpp>
#include <gart/view/server.hpp>

namespace gart_cli {

// A field that is not in the library does not compile.
#define GART_CLI_FIELD(type, field) (static_cast<void>(&gart::type::field), #type "." #field)

std::vector<field_name> const& field_names() {
  static std::vector<field_name> const names = {
      {GART_CLI_FIELD(train_options, iterations), "--iterations"},
      {GART_CLI_FIELD(train_options, max_gaussians), "--max-gaussians"},
      {GART_CLI_FIELD(train_options, random_points), "--points"},
      {GART_CLI_FIELD(train_options, densify), "--densify"},
      {GART_CLI_FIELD(train_options, background), "--background"},
      {GART_CLI_FIELD(train_options, initial_opacity), "--init-opacity"},
      {GART_CLI_FIELD(train_options, initial_scale), "--init-scale"},
      {GART_CLI_FIELD(train_options, exposure), "--exposure"},
      {GART_CLI_FIELD(train_options, vignetting), "--vignetting"},
      {GART_CLI_FIELD(train_options, depth_weight), "--depth-weight"},
      {GART_CLI_FIELD(train_options, refine_poses), "--refine-poses"},
      {GART_CLI_FIELD(train_options, refine_lens), "--refine-lens"},
      {GART_CLI_FIELD(train_options, lt_budget), "--lt-budget"},
      {GART_CLI_FIELD(train_options, check_finite), "--check-finite"},
      {GART_CLI_FIELD(train_options, batch), "--batch"},
      {GART_CLI_FIELD(train_options, shard_block), "shard_block"},  // no option
      {GART_CLI_FIELD(train_options, seed), "--seed"},
      {GART_CLI_FIELD(train_options, dropout), "--set dropout"},
      {GART_CLI_FIELD(train_options, dropout_until), "--set dropout_until"},
      {GART_CLI_FIELD(resolution_options, quarter_until), "--set resolution.quarter_until"},
      {GART_CLI_FIELD(resolution_options, half_until), "--set resolution.half_until"},
      {GART_CLI_FIELD(resolution_options, least), "--set resolution.least"},
      {GART_CLI_FIELD(resolution_options, long_run), "--set resolution.long_run"},
      {GART_CLI_FIELD(split_shape, share), "--set error.split.share"},
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
      {GART_CLI_FIELD(configuration_request, lt_format), "--lt-format"},
      {GART_CLI_FIELD(configuration_request, depth), "--depth-weight"},
      {GART_CLI_FIELD(view_server_options, listen), "--listen"},
      {GART_CLI_FIELD(view_server_options, port), "--port"},
  };
  return names;
}

#undef GART_CLI_FIELD

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
    field_name const* found = nullptr;
    for (field_name const& n : field_names())
      if (n.field == name) found = &n;
    bool const foreign = found && has && found->option.starts_with("--") &&
                         !has(std::string(found->option.substr(0, found->option.find(' '))));
    if (foreign) shown += "gart train ";
    shown += found ? found->option : name;
    shown += word.substr(name.size());
    if (found && name == word && message.substr(0, equals.size()) == equals) {
      shown += ' ';
      message.remove_prefix(equals.size());
    }
  }
  return shown;
}

}  // namespace gart_cli
