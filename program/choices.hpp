#pragma once
// The settings that the program chooses for a capture where the command line leaves them open, each with its reason. A
// run prints them at its start, and keeps them under "chosen" in config.json, metrics.json and report.html.

#include "train/train_arguments.hpp"

#include <gart/runtime/capture_defaults.hpp>

#include <nlohmann/json.hpp>

#include <string>

namespace gart_cli {

// "white" or "black".
gart::decision<std::string> background_for(gart::capture_traits const& traits);

// Replaces "auto" in `a` by the choices for the capture; a list of {"option", "value", "why"}. Where an option was
// given, "why" says so.
nlohmann::json choose(train_arguments& a, gart::dataset const& data);

// The choices of a resumed run, from its config.json; `now` where that does not say.
nlohmann::json chosen_before(nlohmann::json const& config, nlohmann::json const& now);

// Whether settings are left to try, in a run that is long enough.
bool has_trials(train_arguments const& a, gart::dataset const& data);
// Tries settings that the command line leaves open in short trainings (gart/runtime/validation.hpp); returns how, and
// each trial.
nlohmann::json measure(train_arguments a, gart::dataset const& data, gart::validation_progress const& progress);
// Applies the measured settings to `a`, and adds them to the choices, and what follows from them: budget and sizes.
void settle(train_arguments& a, gart::dataset const& data, nlohmann::json const& measured, nlohmann::json& chosen);

}  // namespace gart_cli
