#include "choices.hpp"

#include "progress.hpp"
#include "train_fields.hpp"

#include <gart/optim/error_growth.hpp>
#include <gart/runtime/degree_selection.hpp>
#include <gart/train/resolution.hpp>

#include <algorithm>
#include <cstdio>

namespace gart_cli {

namespace {

char const* const by_option = "given";

std::string short_number(float value) {
  char text[32];
  std::snprintf(text, sizeof text, "%g", static_cast<double>(value));
  return text;
}

// Until which step images are smaller than their photographs: the largest photographs'.
gart::chosen<std::string> sizes_in_words(gart::dataset const& data, gart::train_options const& options) {
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

}  // namespace

gart::chosen<std::string> background_for(gart::capture_traits const& traits) {
  auto const choice = gart::choose_background(traits);
  return {gart::to_string(choice.value), choice.why};
}

nlohmann::json choose(train_arguments& a, gart::dataset const& data) {
  gart::capture_traits const traits = gart::inspect(data);
  nlohmann::json all = nlohmann::json::array();
  auto const say = [&](std::string const& what, std::string const& value, std::string const& why) {
    all.push_back({{"option", what}, {"value", value}, {"why", why}});
  };
  auto const settle = [&](std::string const& what, std::string& value, gart::chosen<std::string> const& choice) {
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
  auto const exposure = gart::choose_exposure(traits);
  settle("--exposure", a.exposure, {exposure.value ? "on" : "off", exposure.why});
  auto const vignetting = gart::choose_vignetting(traits);
  settle("--vignetting", a.vignetting, {vignetting.value ? "on" : "off", vignetting.why});
  say("masks", traits.masked ? std::to_string(traits.masked) + " of " + std::to_string(traits.views) : "none",
      traits.masked ? "what they exclude counts in no loss" : "the capture has none");

  if (a.start.empty()) {
    auto const start = gart::choose_start(data, train_options_of(a));
    say("start", with_commas(start.value.count),
        start.value.measured                      ? "the capture has no points: of its depth maps"
        : start.value.random                      ? "the capture has no points: random ones"
        : start.value.count == data.points.size() ? "the capture's points"
                                                  : "a random subset of the capture's points");
    say("--init-opacity", short_number(start.value.opacity), a.initial_opacity != 0 ? by_option : start.why);
    say("--init-scale", short_number(start.value.scale), a.initial_scale != 0 ? by_option : start.why);
  }
  gart::train_options const options = train_options_of(a);
  auto const budget = gart::choose_budget(data, options);
  if (options.densify != gart::densify_kind::none) say("budget", with_commas(budget.value), budget.why);
  auto const [sizes, why_sizes] = sizes_in_words(data, options);
  say("images", sizes, why_sizes);
  auto const careful = gart::choose_regularization(traits, options);
  // What is chosen is recorded as if it had been given: a resumed run has that, and chooses nothing.
  auto const settle_field = [&](std::string const& name, float as_said, float choice) {
    bool const given = sets_field(a.set, name), changes = !given && !a.resume && choice != as_said;
    if (given || changes) say("--set " + name, short_number(given ? as_said : choice), given ? by_option : careful.why);
    if (changes) a.set = name + "=" + short_number(choice) + (a.set.empty() ? "" : "," + a.set);
    return given || changes;
  };
  settle_field("dropout", options.dropout, careful.value.dropout);
  if (train_options_of(a).dropout > 0)
    settle_field("dropout_until", options.dropout_until, careful.value.dropout_until);
  settle_field("ssim_weight", options.ssim_weight, careful.value.ssim_weight);
  if (!settle_field("error.split.share", options.error.split.share, careful.value.split_share) &&
      options.densify == gart::densify_kind::error) {
    float const share = gart::split_share(options.error, options.max_gaussians, traits.pixels);
    say("--set error.split.share", short_number(share),
        budget.value < options.max_gaussians ? "their pixels end growth, and nearer halves take more memory"
                                             : "near halves fit what they share");
  }
  gart::configuration_request const wanted = configuration_request_of(a);
  auto const plan = gart::plan_trials(wanted, options, data.train.size());
  bool const measured = !plan.held_out.empty();
  say("--sh-degree", (measured ? "at most " : "") + std::to_string(wanted.sh_degree),
      a.sh_degree != "auto" ? by_option
      : !a.automatic        ? "every band; --auto measures which pay"
                            : plan.why);
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

nlohmann::json trials_of(std::vector<gart::band_trial> const& trials) {
  nlohmann::json all = nlohmann::json::array();
  for (auto const& t : trials) {
    all.push_back({{"band", t.band},
                   {"step", t.step},
                   {"psnr_with", t.with},
                   {"psnr_without", t.without},
                   {"gain", t.gain()},
                   {"gain_error", t.error},
                   {"forecast", t.forecast},
                   {"gain_wanted", t.gain_wanted},
                   {"kept", t.kept()}});
  }
  return all;
}

std::string in_words(gart::band_trial const& t) {
  return "SH band " + std::to_string(t.band) + ": " + fixed(t.with, 3) + " dB on the views held out, " +
         fixed(t.without, 3) + " dB without it: a gain of " + fixed(t.gain(), 3) + " dB, give or take " +
         fixed(t.error, 3) + ", by the end at most " + fixed(t.forecast, 3) + " dB: " +
         (!t.kept()                    ? "goes"
          : t.forecast < t.gain_wanted ? "the views differ too much to tell, and it stays"
                                       : "stays");
}

}  // namespace gart_cli
