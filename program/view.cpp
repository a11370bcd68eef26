#include "choices.hpp"
#include "commands.hpp"
#include "interrupt.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "run_folder.hpp"
#include "view_options.hpp"

#include <gart/io/dataset.hpp>
#include <gart/view/model_view.hpp>
#include <gart/view/server.hpp>

#include <cstdio>
#include <memory>
#include <optional>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

struct view_arguments {
  fs::path model, capture;
  configuration_options configuration;
  view_options view;
  photo_options photos;
  std::string background = "auto";
  int downscale = 1, test_every = 8;
};

// What the run was trained on that left the model, else what suits the capture.
std::string background_of(view_arguments const& a, gart::dataset const& data) {
  if (a.background != "auto") return a.background;
  if (std::string const trained = background_of_run(a.model); !trained.empty()) return trained;
  return a.capture.empty() ? "black" : background_for(gart::inspect(data)).value;
}

int run_view(view_arguments const& a) {
  gart::model_file file = gart::load_model(a.model);
  progress(false).notes(file.notes);
  gart::dataset data;
  if (!a.capture.empty()) {
    gart::dataset_options options;
    options.downscale = a.downscale, options.test_every = a.test_every;
    options.origin = file.origin;
    a.photos.set(options);
    data = gart::load_dataset(a.capture, options);
    progress(false).notes(data.notes);
  }
  auto const renderer = gart::make_renderer(configuration_request_for(file, a.model, a.configuration.request()));
  gart::render_options options = file.render;
  options.background = background_color(background_of(a, data));
  gart::view_scene scene =
      gart::scene_of(a.model.filename().string(), file.model, file.kernel_degree, view_cameras_of(data));
  scene.background = options.background;
  interrupt_guard const interrupt;
  gart::view_server server(std::move(scene), server_options_of(a.view, data));
  say_addresses(server, a.view, stdout);
  std::puts("Ctrl-C ends it.");
  std::fflush(stdout);
  gart::view_render const render = gart::render_of(*renderer, std::move(file.model), options);
  while (!interrupt.wanted()) server.render_next(render, 0.1);
  return exit_interrupted;
}

}  // namespace

void add_view(CLI::App& app, command& selected) {
  auto a = std::make_shared<view_arguments>();
  CLI::App* view = app.add_subcommand(
      "view",
      "Look at a model in the browser, traced as it is, on this machine's CPU or GPU. Writes no file: what\n"
      "is kept (cameras, paths, videos) is saved by the browser.");
  view->add_option("MODEL", a->model, "Gaussians in any format, from gart or another program")
      ->type_name("")
      ->required();
  view->add_option(
          "CAPTURE", a->capture,
          "The capture it was trained on, for its cameras and photographs:\na folder or file as for gart train")
      ->type_name("");
  add_view_options(*view, a->view, "");
  view->add_option("--background", a->background,
                   "black or white. auto: by the config.json of a run beside the\nmodel, else as gart train chooses "
                   "for the capture, else black")
      ->type_name("NAME")
      ->capture_default_str()
      ->check(one_of({"auto", "black", "white"}));
  add_photo_options(*view, a->photos);
  view->add_option("--downscale", a->downscale, "Shrink photographs and their cameras by this whole factor")
      ->type_name("N")
      ->capture_default_str()
      ->check(between(1, 64));
  view->add_option("--test-every", a->test_every, "Every so many photographs is marked as a test view")
      ->type_name("N")
      ->capture_default_str()
      ->check(between(0, 1e9));
  add_configuration_options(*view, a->configuration);
  view->footer(
      "\nPrints two addresses to open in a browser: one may look and control, one may look. Whoever has an address "
      "gets\n"
      "in, and no one else: it holds 128 random bits, new in every run. Ctrl-C ends it, with 130.\n"
      "\nOn another machine, say `remote`: leave --listen as it is, name a port there, and on your own machine run\n"
      "  ssh -L 8765:127.0.0.1:8765 remote\n"
      "then open the address that gart prints. The port must be the same on both sides.\n"
      "\nExamples:\n"
      "  gart view run/model.ply\n"
      "  gart view run/model.ply capture\n"
      "  gart view scene.spz --port 8765");
  view->callback([a, &selected] { selected = [a] { return run_view(*a); }; });
}

}  // namespace gart_cli
