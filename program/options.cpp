#include "options.hpp"

#include "commands.hpp"

#include <gart/io/camera_file.hpp>

#include <algorithm>
#include <cstdlib>
#include <limits>
#include <set>

namespace gart_cli {

nlohmann::json recorded_options::values() const {
  nlohmann::json all = nlohmann::json::object();
  for (auto const& e : entries_) all[e.name] = e.get();
  return all;
}

nlohmann::json recorded_options::continue_from(nlohmann::json const& saved, std::filesystem::path const& file,
                                               std::vector<std::string> const& may_rise) {
  nlohmann::json raised = nlohmann::json::object();
  for (auto const& e : entries_) {
    if (!saved.contains(e.name)) {
      throw gart::io_error(file.string(), "has no option \"" + e.name + "\"", "start anew without --resume");
    }
    nlohmann::json const given = e.get(), &value = saved[e.name];
    bool const named = e.option->count() > 0;
    auto const take = [&e](nlohmann::json const& from) {
      if (e.take) return e.take(from);
      e.option->clear();
      e.option->add_result(from.is_string() ? from.get<std::string>() : from.dump());
      e.option->run_callback();
    };
    try {
      if (!e.take && (value.is_structured() || value.is_null())) throw CLI::ConversionError("it is not one value");
      take(value);
    } catch (CLI::Error const& wrong) {
      throw gart::io_error(file.string(), "option \"" + e.name + "\" is not valid: " + wrong.what(),
                           "correct it, or start anew without --resume");
    }
    if (!named || given == e.get()) continue;
    bool const rises = std::find(may_rise.begin(), may_rise.end(), e.name) != may_rise.end();
    // A budget of 0 is none, which is more than any.
    auto const amount = [&e](nlohmann::json const& v) {
      bool const endless = e.name == "time-budget" && v == 0.0;
      return endless ? std::numeric_limits<double>::infinity() : v.get<double>();
    };
    if (rises && amount(given) > amount(e.get())) {
      raised[e.name] = e.get();
      take(given);
    } else {
      throw usage_error("--" + e.name + " " + given.dump() + ": the run to be resumed has " + e.get().dump() + " in " +
                        file.string() + (rises ? ", and it can only be raised" : "") +
                        " (leave the option out to continue that run, or start another from its "
                        "Gaussians with --start MODEL.ply and another --out)");
    }
  }
  return raised;
}

CLI::Validator one_of_methods() {
  std::vector<std::string> names = gart::gradient_method_names();
  names.insert(names.begin(), "auto");
  return one_of(names);
}

CLI::Validator kernel_degree_names() {
  std::set<int> compiled;
  for (auto const& there : gart::compiled_configurations()) compiled.insert(there.kernel_degree);
  std::vector<std::string> names;
  for (int const degree : compiled) names.push_back(std::to_string(degree));
  return one_of(names);
}

gart::configuration_request configuration_options::request() const {
  gart::configuration_request wanted;
  wanted.backend = gart::from_string<gart::backend_kind>(backend);
  wanted.tracer = gart::from_string<gart::tracer_kind>(tracer);
  wanted.threads = threads;
  return wanted;
}

CLI::Option* add_model(CLI::App& app, std::filesystem::path& model) {
  return add_open(app, "MODEL", model, "", "Gaussians in any format, from gart or another program");
}

void add_downscale(CLI::App& app, int& factor) {
  add_value(app, "--downscale", factor, "N", "Shrink images by this whole factor")->check(between(1, 64));
}

std::vector<gart::named_camera> cameras_from(std::filesystem::path const& file, gart::vec3d const& origin,
                                             int downscale) {
  auto cameras = gart::load_cameras(file);
  if (cameras.empty()) throw gart::io_error(file.string(), "has no cameras", "name a dataset or a camera JSON");
  for (auto& [name, view] : cameras) {
    view.position -= origin;
    if (downscale > 1) view = gart::downscaled(view, downscale, "the camera " + name);
  }
  return cameras;
}

gart::camera through_camera(gart::camera const& view, std::string const& model) {
  try {
    return gart::seen_through(view, model);
  } catch (gart::error const& e) {
    std::string const what = e.what();
    throw usage_error(what.starts_with("camera " + model) ? "--" + what : "--camera " + model + ": " + what);
  }
}

void add_threads(CLI::App& app, int& threads) {
  add_value(app, "--threads", threads, "N", "Threads of the openmp backend, 0: all cores")->check(between(0, 4096));
}

void add_configuration_options(CLI::App& app, configuration_options& options) {
  add_value(app, "--backend", options.backend, "NAME",
            "Backend: serial, openmp (CPU) or cuda;\nauto: the fastest there is")
      ->check(name_of_a<gart::backend_kind>());
  add_value(app, "--tracer", options.tracer, "NAME",
            "Tracer: tiles, bvh, embree (CPU), or optix (CUDA);\nthe images are the same")
      ->check(name_of_a<gart::tracer_kind>());
  add_threads(app, options.threads);
}

void add_max_hits(CLI::App& app, int& max_hits) {
  add_open(app, "--max-hits", max_hits, "N",
           "Hits after which a ray ends, 0: no cap\n(default: what the model says, else 0)")
      ->check(between(0, gart::max_hits_most));
}

void add_exposures(CLI::App& app, std::filesystem::path& file) {
  add_open(app, "--exposures", file, "FILE",
           "exposures.json of the model's training: each view gets the exposure\nof the training views about it, "
           "and its lens's vignetting");
}

void add_photo_options(CLI::App& command, photo_options& o) {
  add_open(command, "--photos", o.photos, "DIR",
           "The folder that the photographs' names are in (default: where the\ncapture has it, as images beside "
           "sparse)");
  command.add_flag("--no-masks", o.no_masks,
                   "Leave out the masks that the capture names, or that are in a\nfolder masks beside its photographs");
}

gart::vec3 background_color(std::string const& name) { return gart::vec3(name == "white" ? 1.0f : 0.0f); }

gart::configuration_request configuration_request_for(gart::model_file const& file, std::filesystem::path const& path,
                                                      gart::configuration_request wanted) {
  wanted.sh_degree = file.model.sh_degree;
  wanted.kernel_degree = file.kernel_degree;
  try {
    gart::resolve(wanted);
  } catch (gart::unsupported const& e) {
    throw gart::unsupported(path.string() + ": " + e.what());
  }
  return wanted;
}

nlohmann::json approximations_of(gart::render_options const& render, gart::configuration_info const& configuration) {
  return {{"alpha_min", render.alpha_min},
          {"transmittance_min", render.transmittance_min},
          {"max_hits", render.max_hits},
          {"antialias", render.antialias},
          {"hit_format", gart::to_string(configuration.hit_format)}};
}

}  // namespace gart_cli
