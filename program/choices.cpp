#include "choices.hpp"

#include "progress.hpp"
#include "train/train_fields.hpp"

#include <gart/runtime/validation.hpp>
#include <gart/train/densify/error_growth.hpp>
#include <gart/train/resolution.hpp>

#include <algorithm>
#include <cstdio>

namespace gart_cli {

namespace {

char const* const by_option = "given";

// Until which step images are smaller than their photographs: the largest photographs'.
gart::decision<std::string> sizes_in_words(gart::dataset const& data, gart::train_options const& options) {
  int most = 1;
  for (auto const& v : data.train) most = std::max(most, gart::shrink_of(v.view, 4, options.resolution));
  auto const until = [&](int shrink) {
    return most < shrink ? 0 : gart::steps_shrunk(options.resolution, shrink, options.iterations);
  };
  auto const words = [&](char const* size, int steps) {
    return std::string(size) + " of their width until step " + with_commas(static_cast<std::uint64_t>(steps));
  };
  int const quarter = until(4), half = until(2);
  if (quarter + half == 0)
    return {"full size", most > 1 ? by_option
                                  : "smaller ones would be less than " + std::to_string(options.resolution.least) +
                                        " pixels wide or high"};
  return {quarter == 0     ? words("half", half)
          : half > quarter ? words("a quarter", quarter) + ", " + words("half", half)
                           : words("a quarter", quarter),
          "few and large Gaussians need no more pixels"};
}

// The option of a setting; null for those of --set.
template <class Arguments>
auto* option_of(Arguments& a, std::string const& setting) {
  return setting == "match"        ? &a.match
         : setting == "exposure"   ? &a.exposure
         : setting == "vignetting" ? &a.vignetting
                                   : nullptr;
}

}  // namespace

gart::decision<std::string> background_for(gart::capture_traits const& traits) {
  auto const choice = gart::choose_background(traits);
  return {gart::to_string(choice.value), choice.why};
}

nlohmann::json choose(train_arguments& a, gart::dataset const& data) {
  gart::capture_traits const traits = gart::inspect(data);
  nlohmann::json all = nlohmann::json::array();
  auto const say = [&](std::string const& what, std::string const& value, std::string const& why) {
    all.push_back({{"option", what}, {"value", value}, {"why", why}});
  };
  auto const settle = [&](std::string const& what, std::string& value, gart::decision<std::string> const& choice) {
    bool const given = value != "auto";
    if (!given) value = choice.value;
    say(what, value, given ? by_option : choice.why);
  };

  say("scene", traits.bounded() ? "bounded" : "unbounded",
      traits.clear_border   ? "the images' borders are transparent"
      : traits.plain_border ? "the images' borders are plain"
                            : "the images' borders show it");
  settle("--background", a.background, background_for(traits));
  auto const tracer = gart::choose_tracer(traits);
  settle("--tracer", a.tracer, {gart::to_string(tracer.value), tracer.why});
  settle("--backward", a.backward, gart::choose_backward(traits));
  say("masks", traits.masked ? std::to_string(traits.masked) + " of " + std::to_string(traits.views) : "none",
      traits.masked ? "excluded pixels count in no loss" : "the capture has none");

  if (a.start.empty()) {
    auto const match = gart::choose_match(traits);
    if (traits.points == 0) settle("--match", a.match, {match.value ? "on" : "off", match.why});
    auto const start = gart::choose_start(data, train_options_of(a));
    say("start", with_commas(start.value.count),
        start.value.measured                      ? "the capture has no points: of its depth maps"
        : start.value.random                      ? "the capture has no points: random ones"
        : start.value.matched && traits.points    ? "the capture's points, and those matched in its photographs"
        : start.value.matched                     ? "points matched in the photographs"
        : start.value.count == data.points.size() ? "the capture's points"
                                                  : "a random subset of the capture's points");
    say("--init-opacity", gart::short_number(start.value.opacity),
        a.options.initial_opacity != 0 ? by_option : start.why);
    say("--init-scale", gart::short_number(start.value.scale), a.options.initial_scale != 0 ? by_option : start.why);
  }
  return all;
}

nlohmann::json chosen_before(nlohmann::json const& config, nlohmann::json const& now) {
  auto const found = config.find("chosen");
  if (found == config.end() || !found->is_array()) return now;
  for (auto const& choice : *found) {
    for (char const* key : {"option", "value", "why"})
      if (!choice.is_object() || !choice.contains(key) || !choice[key].is_string()) return now;
  }
  return *found;
}

namespace {

std::vector<gart::candidate> candidates_of(train_arguments const& a, gart::dataset const& data) {
  std::vector<gart::candidate> all;
  if (a.automatic) all = gart::default_candidates(gart::inspect(data), train_options_of(a));
  std::erase_if(all, [&](gart::candidate const& c) {
    if (c.shortens) return a.length_given || !a.start.empty();
    std::string const* const own = option_of(a, c.setting);
    return own ? *own != "auto" : a.set.has(c.setting);
  });
  return all;
}

}  // namespace

bool has_trials(train_arguments const& a, gart::dataset const& data) {
  bool const beside = gart::resolve(configuration_request_of(a)).backend == gart::backend_kind::cuda;
  return gart::plan_validation(train_options_of(a), data, candidates_of(a, data), beside).tried > 0;
}

nlohmann::json measure(train_arguments a, gart::dataset const& data, gart::validation_progress const& progress) {
  gart::train_options const options = train_options_of(a);
  gart::validation const found =
      gart::validate(configuration_request_of(a), options, data, candidates_of(a, data), progress);
  nlohmann::json trials = nlohmann::json::array();
  for (gart::trial const& t : found.trials)
    trials.push_back({{"setting", t.setting},
                      {"value", t.value},
                      {"psnr", t.psnr},
                      {"gain", t.gain},
                      {"noise", t.noise},
                      {"taken", t.taken},
                      {"why", t.why}});
  bool const ended = found.plan.tried > 0 && found.trials.empty();
  return {{"held_out", found.plan.held_out.size()},
          {"shrink", found.plan.shrink},
          {"steps", found.plan.steps},
          {"trials", trials},
          {"why", !a.automatic ? "--no-auto: the usual settings"
                  : ended      ? "no trial came to its end; planned were " + found.plan.why
                               : found.plan.why}};
}

void settle(train_arguments& a, gart::dataset const& data, nlohmann::json const& measured, nlohmann::json& chosen) {
  auto const say = [&](std::string const& what, std::string const& value, std::string const& why) {
    chosen.push_back({{"option", what}, {"value", value}, {"why", why}});
  };
  say("measured", measured["trials"].empty() ? "nothing" : "on held-out views", measured["why"]);
  for (auto const& t : measured["trials"]) {
    std::string const setting = t["setting"], value = t["value"], why = t.value("why", "");
    if (setting.empty()) continue;
    std::string* const own = option_of(a, setting);
    bool const length = setting == "iterations";
    double const gain = t["gain"];
    if (t["taken"]) {
      if (own)
        *own = value;
      else if (length)
        a.options.iterations = std::stoi(value);
      else
        a.set.set(setting, value);
    }
    say((own || length ? "--" : "--set ") + setting + " " + value, t["taken"] ? "taken" : "left",
        (gain < 0 ? "" : "+") + fixed(gain, 2) + " dB, give or take " + fixed(t["noise"].get<double>(), 2) +
            (why.empty() ? "" : "; " + why));
  }
  // Settings that were not measured keep the usual values.
  for (auto const& [own, given] :
       {std::pair{&a.match, "off"}, {&a.exposure, "off"}, {&a.vignetting, "off"}, {&a.densify, "error"}})
    if (*own == "auto") *own = given;

  gart::train_options const options = train_options_of(a);
  auto const budget = gart::choose_budget(data, options);
  if (options.densify != gart::densify_kind::none) say("budget", with_commas(budget.value), budget.why);
  auto const [sizes, why_sizes] = sizes_in_words(data, options);
  say("images", sizes, why_sizes);
  if (options.densify == gart::densify_kind::error && !a.set.has("error.split.offset")) {
    float const share = gart::split_offset(options.error, options.max_gaussians, data.training_pixels());
    say("--set error.split.offset", gart::short_number(share),
        budget.value < options.max_gaussians ? "their pixels end growth, and nearer children take more memory"
                                             : "near children fit their shared pixels");
  }
}

}  // namespace gart_cli
