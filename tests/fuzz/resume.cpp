// config.json and history.json, as `gart train --resume` reads them.

#include "fuzz/support.hpp"

#include <report/history.hpp>
#include <train/train_arguments.hpp>

#include <gart/io/dataset.hpp>

#include <cmath>
#include <string>

namespace gart_fuzz {
namespace {

// Options that the program has had only since the input was made get their defaults, lest an old corpus reach nothing.
std::string completed(std::string_view input, nlohmann::json const& defaults) {
  std::string text(input);
  std::string const opening = "\"options\": {";
  std::size_t const at = text.find(opening);
  for (auto const& [name, value] : defaults.items()) {
    if (at == std::string::npos || text.find('"' + name + '"') != std::string::npos) continue;
    text.insert(at + opening.size(), '"' + name + "\": " + value.dump() + ", ");
  }
  return text;
}

}  // namespace

bool resume_config(std::string_view input) {
  static scratch_folder const folder("resume_config");
  static gart::dataset const data = [] {
    gart::dataset d;
    d.train.resize(2), d.test.resize(1);
    return d;
  }();
  folder.put("checkpoint.gart", "");
  CLI::App app;
  gart_cli::train_arguments a;
  gart_cli::add_arguments(app, a);
  folder.put("config.json", completed(input, a.recorded.values()));
  return accepted(folder, [&] {
    a.out = folder.path();
    a.resume = true;
    gart_cli::continue_run(a);
    gart::train_options const o = gart_cli::train_options_of(a);
    promise(o.iterations >= 1 && o.max_gaussians >= 1 && o.random_points >= 1 && a.downscale >= 1 && a.test_every >= 0,
            "a count that the command line would refuse");
    promise(o.render.alpha_min > 0 && o.render.alpha_min < 1 && o.render.transmittance_min >= 0 &&
                o.render.transmittance_min < 1 && o.initial_opacity >= 0 && o.initial_opacity < 1 &&
                o.initial_scale >= 0 && a.hit_memory_gb >= 0,
            "a number that the command line would refuse");
    gart_cli::check_same_dataset(a, data);
  });
}

bool resume_history(std::string_view input) {
  static scratch_folder const folder("resume_history");
  fs::path const file = folder.put("history.json", input);
  return accepted(folder, [&] {
    int const last = 1000;
    gart_cli::history course(2000);
    course.restore(file, last);
    for (auto const& p : course.train) promise(p.step >= 0 && p.step <= last, "a step after the checkpoint");
    for (auto const& p : course.test) promise(p.step >= 0 && p.step <= last, "a test after the checkpoint");
    promise(std::isfinite(course.seconds) && course.seconds >= 0, "a time that is no time");
    promise(course.to_json()["train"].size() == course.train.size(), "a point that is lost");
  });
}

}  // namespace gart_fuzz
