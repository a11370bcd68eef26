#pragma once
// What `gart train` was asked for, and its way into config.json and back.

#include "options.hpp"
#include "train_fields.hpp"
#include "view_options.hpp"

#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/session.hpp>
#include <gart/train/options.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <optional>
#include <string>

namespace gart_cli {

inline constexpr int quick_iterations = 9500;  // of --preset quick

struct train_arguments {
  std::filesystem::path dataset, out;
  bool resume = false, quiet = false;
  std::optional<gart::vec3d> origin;  // of the run to be resumed
  int threads = 0, stop_at = 0;
  std::string parallel = "strips";
  int gpus = 1;
  nlohmann::json raised = nlohmann::json::object();  // options raised by a resuming command line: what they were
  float checkpoint_minutes = 10;
  bool viewed = false;
  view_options view;
  double view_share = 0.1;

  // What follows decides the result and is recorded.
  std::string backend = "auto", tracer = "auto", backward = "auto", densify = "auto", background = "auto", start, poses,
              scene;
  std::string hit_format = "auto";
  std::string preset = "exact";
  gart::train_options options;  // by the table of fields; "auto" here is open there
  double time_budget = 0;       // seconds of training; 0: none
  bool length_given = false;    // by --iterations, --preset or --time-budget
  int kernel_degree = 2;
  bool automatic = true;
  int sh_degree = 3;
  int downscale = 1, test_every = 8, eval_every = -1;
  std::string test_split = "nth";
  std::string photos;
  bool no_masks = false;
  std::string depth_kind = "auto";
  double depth_unit = 0;
  std::string match = "auto", exposure = "auto", vignetting = "auto", adam = "all";
  field_values set;
  bool antialias = false;
  double hit_memory_gb = 0;
  recorded_options recorded;

  std::filesystem::path config_file() const { return out / "config.json"; }
  std::filesystem::path checkpoint_file() const { return out / "checkpoint.gart"; }
  std::filesystem::path history_file() const { return out / "history.json"; }
  std::filesystem::path model_file() const { return out / "model.ply"; }
  // The share of the run that is done.
  double progress(int step, double seconds) const {
    double const by_steps = static_cast<double>(step) / options.iterations;
    return std::min(1.0, time_budget > 0 ? std::max(by_steps, seconds / time_budget) : by_steps);
  }
  // The length that schedules go by: so many steps that `step` of them are the progress. A run is over where it has
  // come to it.
  int length(int step, double seconds) const {
    double const by_steps = static_cast<double>(step) / options.iterations, share = progress(step, seconds);
    return share > by_steps ? std::max(1, static_cast<int>(step / share)) : options.iterations;
  }
  int steps_between_tests() const { return eval_every >= 0 ? eval_every : std::max(1, options.iterations / 5); }
};

void add_arguments(CLI::App& train, train_arguments& a);
// Sets the options of the preset that the command line leaves open.
void fill_in(CLI::App const& train, train_arguments& a);
// Takes the options and the origin of the run in `out`, and its dataset if none was named. Throws io_error without such
// a run.
void continue_run(train_arguments& a);
gart::configuration_request configuration_request_of(train_arguments const& a);
// `background` is a colour's name or "random".
gart::train_options train_options_of(train_arguments const& a);
// With "auto" replaced by its result, so that a resumed run cannot choose otherwise.
nlohmann::json config_of(train_arguments const& a, gart::dataset const& data);
// usage_error where the dataset is not the one that config.json tells of.
void check_same_dataset(train_arguments const& a, gart::dataset const& data);

}  // namespace gart_cli
