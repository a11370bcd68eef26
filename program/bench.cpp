#include "commands.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "timing.hpp"

#include <gart/io/dataset.hpp>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <numeric>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

struct bench_arguments {
  fs::path model, cameras, json;
  configuration_options configuration;
  std::string backward = "auto", hit_format = "auto";
  int views = 4, warmups = 5, repeats = 20;
  bool quiet = false;
};

// A capture of one view. Its photograph is noise, so that every pixel has a gradient.
gart::dataset noise_capture(gart::named_camera const& camera) {
  gart::dataset data;
  gart::dataset_view view;
  view.name = camera.name, view.view = camera.view;
  view.image = gart::image8(camera.view.width, camera.view.height, 3);
  gart::u32 state = 12345;
  for (auto& value : view.image.data) {
    state = state * 1664525u + 1013904223u;
    value = static_cast<gart::u8>(state >> 24);
  }
  data.train.push_back(std::move(view));
  return data;
}

int run_bench(bench_arguments const& a) {
  gart::model_file const file = gart::load_model(a.model);
  auto cameras = cameras_from(a.cameras, file.origin);
  if (static_cast<int>(cameras.size()) > a.views) cameras.resize(static_cast<std::size_t>(a.views));
  if (!a.json.empty()) prepare_file(a.json);

  auto wanted = a.configuration.request();
  wanted.backward = a.backward, wanted.hit_format = gart::from_string<gart::hit_format_kind>(a.hit_format);
  auto const request = configuration_request_for(file, a.model, wanted);
  gart::train_options options;
  options.densify = gart::densify_kind::none;
  options.iterations = 1;  // the full SH degree from the first step
  options.sh_every = 1;
  options.render = file.render;
  options.render.near = gart::render_options().near;  // training has its own
  // Rates of zero do not change the model; Adam's work is the same.
  options.rates = {0, 0, 0, 0, 0, 0, 0};

  std::map<std::string, double> stages;
  double wall = 0, processor = 0, hits = 0, hit_buffer_bytes = 0;
  std::size_t peak = 0;
  gart::configuration_info configuration;
  progress say(a.quiet);
  say.notes(file.notes);
  for (std::size_t v = 0; v < cameras.size(); ++v) {
    gart::dataset const data = noise_capture(cameras[v]);
    auto const session = gart::make_session(request, options, data, &file.model);
    configuration = session->configuration();
    // A device is still at the end of a step when the next begins: some in a row are timed, and the last waited for.
    int const steps_together = configuration.backend == gart::backend_kind::cuda ? 4 : 1;
    std::map<std::string, std::vector<double>> samples;
    std::vector<double> walls, processors;
    for (int i = -a.warmups; i < a.repeats; ++i) {
      // Times by stage and the whole step's wall time are taken in turns: timing the stages costs a little itself.
      session->profile().enable(false);
      double const before = processor_ms();
      stopwatch const steps;
      for (int k = 0; k < steps_together; ++k) session->step();
      session->profile();  // waits for the last
      double const ms = steps.milliseconds() / steps_together;
      double const used = (processor_ms() - before) / steps_together;
      session->profile().enable(true);
      session->profile().clear();
      session->step();
      if (i < 0) continue;
      walls.push_back(ms), processors.push_back(used);
      for (auto const& [label, time] : session->profile().stages()) samples[label].push_back(time.milliseconds);
    }
    for (auto& [label, list] : samples) stages[label] += median(list) / static_cast<double>(cameras.size());
    wall += median(walls) / static_cast<double>(cameras.size());
    processor += median(processors) / static_cast<double>(cameras.size());
    auto const image = session->render(cameras[v].view, gart::vec3(0.0f));
    hits += std::accumulate(image.hits.data.begin(), image.hits.data.end(), 0.0) /
            static_cast<double>(image.hits.data.size() * cameras.size());
    hit_buffer_bytes += static_cast<double>(session->hit_buffer_bytes()) / static_cast<double>(cameras.size());
    peak = std::max(peak, session->peak_bytes());
    say.state("measured " + std::to_string(v + 1) + "/" + std::to_string(cameras.size()),
              static_cast<double>(v + 1) / static_cast<double>(cameras.size()));
  }
  say.clear();
  nlohmann::json result = {{"backend", gart::to_string(configuration.backend)},
                           {"tracer", gart::to_string(configuration.tracer)},
                           {"backward", configuration.backward},
                           {"sh_degree", configuration.sh_degree},
                           {"kernel_degree", configuration.kernel_degree},
                           {"hit_format", gart::to_string(configuration.hit_format)},
                           {"gaussians", file.model.size()},
                           {"width", cameras[0].view.width},
                           {"height", cameras[0].view.height},
                           {"views", cameras.size()},
                           {"warmups", a.warmups},
                           {"repeats", a.repeats},
                           {"step_ms", wall},
                           {"step_processor_ms", processor},
                           {"stages_ms", stages},
                           {"hits_per_ray", hits},
                           {"hit_buffer_bytes", hit_buffer_bytes},
                           {"peak_bytes", peak}};
  if (!a.json.empty()) write_json(a.json, result);
  std::string const views =
      cameras.size() == 1 ? "of one view" : "mean over " + std::to_string(cameras.size()) + " views";
  std::printf("%s, %s, %s: %zu Gaussians, %d x %d, medians of %d, %s\n", gart::to_string(configuration.backend),
              gart::to_string(configuration.tracer), configuration.backward.c_str(), file.model.size(),
              cameras[0].view.width, cameras[0].view.height, a.repeats, views.c_str());
  std::printf("  %-24s %10.3f ms\n  %-24s %10.3f ms\n", "whole step", wall, "of the processor", processor);
  for (auto const& [label, ms] : stages) std::printf("  %-24s %10.3f ms\n", label.c_str(), ms);
  std::printf("  %-24s %10.1f\n  %-24s %10s\n  %-24s %10s\n", "hits a ray", hits, "hit buffer",
              as_bytes(hit_buffer_bytes).c_str(), "peak memory", as_bytes(static_cast<double>(peak)).c_str());
  return 0;
}

}  // namespace

void add_bench(CLI::App& app, command& selected) {
  auto a = std::make_shared<bench_arguments>();
  CLI::App* bench = app.add_subcommand("bench", "Time every stage of a training step on a model, camera by camera.");
  add_model(*bench, a->model)->required();
  add_open(*bench, "CAMERAS", a->cameras, "", "A dataset, or a camera JSON as for gart render")->required();
  add_value(*bench, "--backward", a->backward, "NAME",
            "Gradient method: auto, pixel, hybrid, primitive or\ndeterministic (sums in a fixed order)")
      ->check(one_of_methods());
  add_value(*bench, "--views", a->views, "N", "The first so many cameras")->check(between(1, 10000));
  add_value(*bench, "--warmups", a->warmups, "N", "Steps before the measured ones, each view")->check(between(0, 1000));
  add_value(*bench, "--repeats", a->repeats, "N",
            "Measurements of each view, on a GPU of four steps in a row;\nthe median counts")
      ->check(between(1, 1000));
  add_open(*bench, "--json", a->json, "FILE", "Write the figures to this file");
  add_quiet(*bench, a->quiet, "Print the table of results alone");
  add_configuration_options(*bench, a->configuration);
  add_value(*bench, "--hit-format", a->hit_format, "NAME", "Record of a hit: float4 or half")
      ->check(name_of_a<gart::hit_format_kind>());
  bench->footer(
      "\nStages nest: \"backward\" is everything between the image's gradient and the parameters', \"backward/...\" "
      "its\n"
      "parts. On a GPU stages are device time, by events; \"whole step\" is wall time, with one wait a step,\n"
      "\"of the processor\" that of all threads together.\n"
      "\nExamples:\n"
      "  gart bench run/model.ply lego --backend cuda --backward primitive --json bench.json\n"
      "  gart bench scene.ply path.json --views 1 --repeats 5");
  bench->callback([a, &selected] { selected = [a] { return run_bench(*a); }; });
}

}  // namespace gart_cli
