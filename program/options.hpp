#pragma once
// Options that several commands share, and the record of a training run's options that --resume reads back.

#include "help.hpp"

#include <gart/backward/gradient_methods.hpp>
#include <gart/io/dataset.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/runtime/session.hpp>

#include <nlohmann/json.hpp>

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace gart_cli {

// Options that config.json keeps. The values bound must live as long as this does.
class recorded_options {
 public:
  template <class T>
  CLI::Option* add(CLI::App& app, std::string const& flag, T& value, std::string const& type, std::string const& help) {
    CLI::Option* option = add_value(app, flag, value, type, help);
    entries_.push_back({flag.substr(2), option, [&value] { return nlohmann::json(value); }});
    return option;
  }
  // A value with a text on the command line (T::of_text) and its own JSON (json, T::of_json). Both readers throw
  // usage_error.
  template <class T>
  requires requires(T const& v) { T::of_json(v.json()); }
  CLI::Option* add(CLI::App& app, std::string const& flag, T& value, std::string const& type, std::string const& help) {
    auto const or_refused = [&value](auto const& read) {
      try {
        value = read();
      } catch (gart::error const& e) {
        throw CLI::ConversionError(e.what());
      }
    };
    CLI::Option* option = app.add_option_function<std::string>(
        flag, [or_refused](std::string const& text) { or_refused([&] { return T::of_text(text); }); }, help);
    option->type_name(type);
    entries_.push_back({flag.substr(2), option, [&value] { return value.json(); },
                        [or_refused](nlohmann::json const& saved) { or_refused([&] { return T::of_json(saved); }); }});
    return option;
  }
  // A flag with its opposite: "--auto,!--no-auto".
  CLI::Option* add_flag(CLI::App& app, std::string const& flags, bool& value, std::string const& help) {
    CLI::Option* option = app.add_flag(flags, value, help);
    entries_.push_back({flags.substr(2, flags.find(',') - 2), option, [&value] { return nlohmann::json(value); }});
    return option;
  }
  nlohmann::json values() const;
  // Takes the values of an earlier run as if they stood on the command line, by the same checks. Throws usage_error for
  // an option that was given and says otherwise. Throws io_error, naming `file` and the option, for one that is missing
  // or invalid on the command line. Options of `may_rise` may be given a larger value, which then counts. The result
  // names each with its earlier value.
  nlohmann::json continue_from(nlohmann::json const& saved, std::filesystem::path const& file,
                               std::vector<std::string> const& may_rise = {});

 private:
  struct entry {
    std::string name;
    CLI::Option* option;
    std::function<nlohmann::json()> get;
    std::function<void(nlohmann::json const&)> take = {};  // empty: by the command line's text
  };
  std::vector<entry> entries_;
};

// --backend --tracer --threads, as every command that traces rays has them.
struct configuration_options {
  std::string backend = "auto", tracer = "auto";
  int threads = 0;

  gart::configuration_request request() const;
};
// MODEL, which every command reads alike.
CLI::Option* add_model(CLI::App& app, std::filesystem::path& model);
void add_downscale(CLI::App& app, int& factor);
// Those of a dataset or a camera JSON, from the model's origin, their images shrunk. io_error where there are none.
std::vector<gart::named_camera> cameras_from(std::filesystem::path const& file, gart::vec3d const& origin,
                                             int downscale = 1);
// A view through the camera of --camera. usage_error where that is none.
gart::camera through_camera(gart::camera const& view, std::string const& model);
void add_threads(CLI::App& app, int& threads);
void add_configuration_options(CLI::App& app, configuration_options& options);
// --max-hits of a model to be rendered: negative where the model says.
void add_max_hits(CLI::App& app, int& max_hits);
// --exposures of a model that was trained with them.
void add_exposures(CLI::App& app, std::filesystem::path& file);

// One of an enumeration's names.
template <gart::named E>
CLI::Validator name_of_a() {
  return one_of(gart::list_of_names<E>());
}
// "auto", or a method.
CLI::Validator one_of_methods();
// Those that some configuration of this build has.
CLI::Validator kernel_degree_names();

gart::vec3 background_color(std::string const& name);

// --photos and --no-masks of the commands that read a capture's images.
struct photo_options {
  std::string photos;
  bool no_masks = false;
  void set(gart::dataset_options& options) const { options.photos = photos, options.masks = !no_masks; }
};
void add_photo_options(CLI::App& command, photo_options& o);

// The configuration for a model; unsupported, naming its file, if no configuration has its degrees.
gart::configuration_request configuration_request_for(gart::model_file const& file, std::filesystem::path const& path,
                                                      gart::configuration_request wanted);
// The parts that a run left out or shortened, for every report.
nlohmann::json approximations_of(gart::render_options const& render, gart::configuration_info const& configuration);

}  // namespace gart_cli
