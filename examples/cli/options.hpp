#pragma once
// Options that several commands share, and the record of a training run's options that --resume reads back.

#include "help.hpp"

#include <gart/train/session.hpp>

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
    CLI::Option* option = app.add_option(flag, value, help)->capture_default_str()->type_name(type);
    entries_.push_back({flag.substr(2), option, [&value] { return nlohmann::json(value); },
                        [&value](nlohmann::json const& saved) { saved.get_to(value); }});
    return option;
  }
  // A flag with its opposite: "--auto,!--no-auto".
  CLI::Option* add_flag(CLI::App& app, std::string const& flags, bool& value, std::string const& help) {
    CLI::Option* option = app.add_flag(flags, value, help);
    entries_.push_back({flags.substr(2, flags.find(',') - 2), option, [&value] { return nlohmann::json(value); },
                        [&value](nlohmann::json const& saved) { saved.get_to(value); }});
    return option;
  }
  nlohmann::json values() const;
  // Takes the values of an earlier run. usage_error for an option that was given and says otherwise; io_error, naming
  // `file` and the option, for one that is missing or of another type.
  void continue_from(nlohmann::json const& saved, std::filesystem::path const& file);

 private:
  struct entry {
    std::string name;
    CLI::Option* option;
    std::function<nlohmann::json()> get;
    std::function<void(nlohmann::json const&)> set;
  };
  std::vector<entry> entries_;
};

// --backend --tracer --threads, as every command that traces rays has them.
struct row_options {
  gart::row_request request;
  int threads = 0;
};
void add_threads(CLI::App& app, int& threads);
void add_row_options(CLI::App& app, row_options& options);
void use_threads(int threads);
// --max-hits of a model to be rendered: negative where the model says.
void add_max_hits(CLI::App& app, int& max_hits);

CLI::Validator backend_names();
CLI::Validator tracer_names();

gart::vec3 background_color(std::string const& name);

// Of a model's file, where the command line does not say otherwise: what it was trained with.
struct model_file {
  gart::gaussian_model model;
  gart::render_options render;
};
// io_error for what is no splat file; unsupported for a kernel that is not traced here.
model_file load_model(std::filesystem::path const& path);
inline constexpr gart::u32 max_hits_most = 1'000'000'000;
// What a run left out, as every report tells it.
nlohmann::json approximations_of(gart::render_options const& render);

}  // namespace gart_cli
