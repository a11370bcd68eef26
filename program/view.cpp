#include "choices.hpp"
#include "commands.hpp"
#include "interrupt.hpp"
#include "model_choice.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "render_scene.hpp"
#include "run_folder.hpp"
#include "view_options.hpp"

#include <gart/io/dataset.hpp>
#include <gart/io/file.hpp>
#include <gart/view/edited_scene.hpp>
#include <gart/view/model_view.hpp>
#include <gart/view/path_view.hpp>
#include <gart/view/server.hpp>

#include <cstdio>
#include <cstdlib>
#include <memory>
#include <optional>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

struct view_arguments {
  fs::path model, capture;
  scene_options scene;
  configuration_options configuration;
  view_options view;
  photo_options photos;
  std::string background = "auto";
  int downscale = 1, test_every = 8;
};

// With a scene that names its models the one file is the capture.
void settle_files(view_arguments& a) {
  if (a.scene.file.empty()) {
    a.scene.require_none(a.model, "view");
    return;
  }
  bool const named = !gart::read_scene_splats(a.scene.file).empty();
  if (a.capture.empty() && (named || fs::is_directory(a.model))) std::swap(a.model, a.capture);
}

// What the run was trained on that left the model, else what suits the capture.
std::string background_of(view_arguments const& a, fs::path const& model, gart::dataset const& data) {
  if (a.background != "auto") return a.background;
  if (std::string const trained = background_of_run(model); !trained.empty()) return trained;
  return a.capture.empty() ? "black" : background_for(gart::inspect(data)).value;
}

// A model that is looked at, and what renders it.
struct opened_model {
  std::unique_ptr<gart::renderer> by;
  gart::view_render render;
  gart::view_scene scene;
};

// From the origin that the capture's cameras are held from.
opened_model open_model(view_arguments const& a, fs::path const& path, gart::model_file file,
                        gart::dataset const& data) {
  progress(false).notes(file.notes);
  if (!a.capture.empty() && file.origin != data.origin)
    throw gart::io_error(
        path.string(),
        "is from the origin " + gart::to_text(file.origin) + ", the capture from " + gart::to_text(data.origin),
        "view it without the capture");
  opened_model out;
  out.by = gart::make_renderer(configuration_request_for(file, path, a.configuration.request()));
  gart::render_options options = file.render;
  options.background = background_color(background_of(a, path, data));
  out.scene = gart::scene_of(path.filename().string(), file.model, file.kernel_degree, view_cameras_of(data));
  out.scene.background = options.background, out.scene.origin = file.origin;
  out.scene.features = file.model.feature_count;
  out.render = gart::render_of(*out.by, std::move(file.model), options);
  return out;
}

gart::dataset capture_of(view_arguments const& a, gart::vec3d const& origin) {
  gart::dataset data;
  if (a.capture.empty()) return data;
  gart::dataset_options options;
  options.downscale = a.downscale, options.test_every = a.test_every;
  options.origin = origin;
  a.photos.set(options);
  data = gart::load_dataset(a.capture, options);
  progress(false).notes(data.notes);
  return data;
}

gart::view_box bounds_of(gart::light::scene const& scene) {
  gart::view_box box{gart::vec3(1e30f), gart::vec3(-1e30f)};
  for (gart::light::mesh const& m : scene.meshes)
    for (gart::vec3 const& p : m.positions) box.low = glm::min(box.low, p), box.high = glm::max(box.high, p);
  return box.low.x <= box.high.x ? box : gart::view_box{gart::vec3(-1.0f), gart::vec3(1.0f)};
}

// Serves until Ctrl-C; `between` is what is done between two views.
template <class Between>
int serve(view_arguments const& a, gart::view_scene scene, gart::dataset const& data, fs::path const& scored,
          gart::view_render const& render, Between const& between) {
  interrupt_guard const interrupt;
  gart::view_server server(std::move(scene), server_options_of(a.view, data));
  server.set_scores(scores_of_run(scored, data));
  say_addresses(server, a.view, stdout);
  auto const browser = open_address(server, a.view);
  std::puts("Ctrl-C ends it.");
  std::fflush(stdout);
  while (!interrupt.wanted()) {
    between(server);
    server.render_next(render, 0.1);
  }
  return 0;
}

// Files that a page sent, for as long as they are looked at.
class sent_files {
 public:
  sent_files() = default;
  sent_files(sent_files const&) = delete;
  ~sent_files() {
    std::error_code ignored;
    if (!folder_.empty()) fs::remove_all(folder_, ignored);
  }
  // Where it lies.
  fs::path keep(gart::added_file const& file) {
    if (folder_.empty()) {
      std::string name = (fs::temp_directory_path() / "gart-view-XXXXXX").string();
      if (!::mkdtemp(name.data())) throw gart::error(name + ": no folder can be made there");
      folder_ = name;
    }
    fs::path const path = folder_ / (std::to_string(++count_) + fs::path(file.name).extension().string());
    gart::write_file(path, file.bytes);
    return path;
  }

 private:
  fs::path folder_;
  int count_ = 0;
};

// Paths of light through Gaussians, meshes and lights, which the page may move.
int view_scene(view_arguments const& a) {
  path_scene scene(a.scene, a.model, a.configuration);
  gart::model_file const& file = scene.model();
  gart::scene_file const& read = scene.file();
  progress(false).notes(file.notes);
  progress(false).notes(read.notes);
  gart::dataset const data = capture_of(a, file.origin);
  gart::render_options options = file.render;
  options.background = background_color(background_of(a, a.model, data));
  if (a.background == "auto" && read.background) options.background = *read.background;

  std::vector<gart::view_camera> cameras = view_cameras_of(data);
  for (gart::named_camera const& c : read.cameras) {
    cameras.push_back({c.name, c.view});
    cameras.back().view.position -= file.origin;
  }
  gart::view_scene shown =
      gart::scene_of(a.scene.file.filename().string(), file.model, file.kernel_degree, std::move(cameras));
  if (file.model.size() == 0) shown.bounds = bounds_of(read.scene);
  shown.background = options.background, shown.origin = file.origin, shown.traced = true;
  gart::edited_scene edited(a.scene.file, read, file.origin, a.model, 0.5f * (shown.bounds.low + shown.bounds.high),
                            gart::extent_of(shown));
  sent_files sent;
  shown.parts = edited.parts(), shown.scene_json = edited.text();
  auto const render = gart::render_of(scene.renderer(), file.model, options, read.paths);
  return serve(a, std::move(shown), data, a.model, render, [&](gart::view_server& server) {
    bool changed = false;
    while (auto const edit = server.next_edit()) {
      try {
        edited.change(*edit);
        changed = true;
      } catch (std::exception const& e) {
        server.tell(std::string("It could not be changed: ") + e.what());
      }
    }
    while (auto const file = server.next_file()) {
      try {
        edited.add(sent.keep(*file), file->name);
        server.tell(file->name + " is in the scene.");
        changed = true;
      } catch (std::exception const& e) {
        server.tell(file->name + " could not be added: " + e.what());
      }
    }
    if (!changed) return;
    scene.renderer().set_scene(edited.scene());
    server.set_parts(edited.parts(), edited.text());
  });
}

int run_view(view_arguments a) {
  settle_files(a);
  if (!a.scene.file.empty()) return view_scene(a);
  gart::model_file first = gart::load_model(a.model);
  gart::dataset const data = capture_of(a, first.origin);
  model_choice const models(a.model);
  auto const named = [&](gart::view_scene scene, int which) {
    scene.models = models.names(), scene.model = which;
    return scene;
  };
  opened_model shown = open_model(a, a.model, std::move(first), data);
  gart::view_scene scene = named(std::move(shown.scene), models.first());
  return serve(a, std::move(scene), data, a.model, shown.render, [&](gart::view_server& server) {
    auto const wanted = server.next_model();
    if (!wanted) return;
    fs::path const path = models.path(*wanted);
    try {
      opened_model next = open_model(a, path, gart::load_model(path), data);
      shown = std::move(next);
      server.set_scene(named(std::move(shown.scene), *wanted));
      server.set_scores(scores_of_run(path, data));
    } catch (std::exception const& e) {
      server.tell(std::string("It could not be opened: ") + e.what());
    }
  });
}

}  // namespace

void add_view(CLI::App& app, command& selected) {
  auto a = std::make_shared<view_arguments>();
  CLI::App* view = app.add_subcommand(
      "view",
      "Look at a model in the browser, traced as it is, on this machine's CPU or GPU. Writes no file: what\n"
      "is kept (cameras, images, paths, videos) is saved by the browser. The page can open other models that\n"
      "lie beside MODEL, and the model.ply of runs beside its run.");
  add_model(*view, a->model);
  add_open(*view, "CAPTURE", a->capture, "",
           "The capture it was trained on, for its cameras and photographs:\na folder or file as for gart train");
  add_view_options(*view, a->view, "");
  add_value(*view, "--background", a->background, "NAME",
            "black or white. auto: by the config.json of a run beside the\nmodel, else as gart train chooses "
            "for the capture, else black")
      ->check(one_of({"auto", "black", "white"}));
  add_photo_options(*view, a->photos);
  add_downscale(*view, a->downscale);
  add_value(*view, "--test-every", a->test_every, "N", "Every so many photographs is marked as a test view")
      ->check(between(0, 1e9));
  add_scene_options(*view, a->scene);
  add_configuration_options(*view, a->configuration);
  view->footer(
      "\nPrints two addresses to open in a browser: one may look and control, one may look. Whoever has an address "
      "gets\n"
      "in, and no one else: it holds 128 random bits, new in every run. Ctrl-C ends it, with 0.\n"
      "\nOn another machine, say `remote`: leave --listen as it is, name a port there, and on your own machine run\n"
      "  ssh -L 8765:127.0.0.1:8765 remote\n"
      "then open the address that gart prints. The port must be the same on both sides.\n"
      "\nIn a container, or behind a proxy that ends https: --listen 0.0.0.0 --port 8765 --allow-host NAME, with the "
      "name\n"
      "that stands in the browser's address; the path of the printed address follows it.\n"
      "\nExamples:\n"
      "  gart view run/model.ply\n"
      "  gart view run/model.ply capture\n"
      "  gart view scene.spz --port 8765\n"
      "  gart view run/model.ply --scene teapot.glb      lit, mirrored and moved on the page");
  view->callback([a, view, &selected] { selected = [a] { return run_view(*a); }; });
}

}  // namespace gart_cli
