#include "options.hpp"

#include "commands.hpp"

#include <gart/io/ply.hpp>

#include <algorithm>
#include <cstdlib>
#if defined(_OPENMP)
#include <omp.h>
#endif

namespace gart_cli {

nlohmann::json recorded_options::values() const {
  nlohmann::json all = nlohmann::json::object();
  for (auto const& e : entries_) all[e.name] = e.get();
  return all;
}

void recorded_options::continue_from(nlohmann::json const& saved, std::filesystem::path const& file) {
  for (auto const& e : entries_) {
    if (!saved.contains(e.name)) {
      throw gart::io_error(file.string(), "has no option \"" + e.name + "\"", "start anew without --resume");
    }
    nlohmann::json const given = e.get();
    try {
      e.set(saved[e.name]);
    } catch (nlohmann::json::exception const&) {
      throw gart::io_error(file.string(), "option \"" + e.name + "\" is not of its type",
                           "start anew without --resume");
    }
    if (e.option->count() > 0 && given != e.get()) {
      throw usage_error("--" + e.name + " " + given.dump() + ": the run to be resumed has " + e.get().dump() + " in " +
                        file.string() +
                        " (leave the option out to continue that run, or start another from its "
                        "Gaussians with --start MODEL.ply and another --out)");
    }
  }
}

CLI::Validator backend_names() { return one_of({"auto", "serial", "openmp", "cuda"}); }
CLI::Validator tracer_names() { return one_of({"auto", "bvh", "embree", "tiles"}); }

void add_threads(CLI::App& app, int& threads) {
  app.add_option("--threads", threads, "Threads of the openmp backend, 0: all cores")
      ->type_name("N")
      ->capture_default_str()
      ->check(between(0, 4096));
}

void add_row_options(CLI::App& app, row_options& options) {
  app.add_option("--backend", options.request.backend,
                 "What computes: serial, openmp (CPU) or cuda;\nauto: the fastest there is")
      ->type_name("NAME")
      ->capture_default_str()
      ->check(backend_names());
  app.add_option("--tracer", options.request.tracer,
                 "What finds the hits: tiles, bvh, or embree (CPU);\nthe images are the same")
      ->type_name("NAME")
      ->capture_default_str()
      ->check(tracer_names());
  add_threads(app, options.threads);
}

void add_max_hits(CLI::App& app, int& max_hits) {
  app.add_option("--max-hits", max_hits,
                 "Hits after which a ray ends, 0: no cap\n(default: what the model says, else 0)")
      ->type_name("N")
      ->check(between(0, max_hits_most));
}

void use_threads([[maybe_unused]] int threads) {
#if defined(_OPENMP)
  if (threads > 0) omp_set_num_threads(threads);
#endif
}

gart::vec3 background_color(std::string const& name) { return gart::vec3(name == "white" ? 1.0f : 0.0f); }

model_file load_model(std::filesystem::path const& path) {
  gart::ply_traits traits;
  model_file file;
  file.model = gart::read_splat_ply(path, &traits);
  if (auto const kernel = traits.find("kernel_degree"); kernel != traits.end() && kernel->second != "2") {
    throw gart::unsupported(path.string() + ": kernel_degree " + kernel->second +
                            " is not traced by this program, which has Gaussians (kernel_degree 2)");
  }
  auto const number = [&](char const* key, float& value) {
    auto const found = traits.find(key);
    if (found == traits.end()) return;
    char* end = nullptr;
    float const parsed = std::strtof(found->second.c_str(), &end);
    if (end == found->second.c_str() || !(parsed >= 0 && parsed < 1)) {
      throw gart::io_error(path.string(), std::string("comment gart ") + key + " is '" + found->second + "'",
                           "a number from 0 to 1 belongs there; remove the comment for the default");
    }
    value = parsed;
  };
  number("alpha_min", file.render.alpha_min);
  number("t_min", file.render.transmittance_min);
  if (auto const found = traits.find("max_hits"); found != traits.end()) {
    char* end = nullptr;
    unsigned long const parsed = std::strtoul(found->second.c_str(), &end, 10);
    if (end == found->second.c_str() || *end != '\0' || found->second[0] == '-' || parsed > max_hits_most) {
      throw gart::io_error(path.string(), "comment gart max_hits is '" + found->second + "'",
                           "a whole number belongs there, 0 for no cap; remove the comment for none");
    }
    file.render.max_hits = static_cast<gart::u32>(parsed);
  }
  return file;
}

nlohmann::json approximations_of(gart::render_options const& render) {
  return {{"alpha_min", render.alpha_min}, {"t_min", render.transmittance_min}, {"max_hits", render.max_hits}};
}

}  // namespace gart_cli
