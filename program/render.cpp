#include "commands.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "samples.hpp"

#include <gart/io/camera_file.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/exposure_file.hpp>
#include <gart/io/image_file.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

struct render_arguments {
  fs::path model, cameras, out, json, exposures;
  configuration_options configuration;
  std::string background = "black", camera;
  int downscale = 1, samples = 1;
  float alpha_min = -1, t_min = -1;
  int max_hits = -1;
  bool depth = false, quiet = false;
};

struct depth_picture {
  gart::image8 image;
  float nearest = 0, farthest = 0;
};

// The mean distance of what a pixel sees, nearest white and farthest dark; black where it sees less than half.
depth_picture picture_depth(gart::rendered const& r) {
  depth_picture result;
  result.image = gart::image8(r.depth.width, r.depth.height, 1);
  float nearest = std::numeric_limits<float>::max(), farthest = 0;
  std::vector<float> mean(r.depth.data.size(), -1.0f);
  for (std::size_t p = 0; p < mean.size(); ++p) {
    float const seen = 1 - r.transmittance.data[p];
    if (seen < 0.5f) continue;
    mean[p] = r.depth.data[p] / seen;
    nearest = std::min(nearest, mean[p]), farthest = std::max(farthest, mean[p]);
  }
  if (farthest == 0) return result;
  float const range = std::max(farthest - nearest, 1e-6f * farthest);
  for (std::size_t p = 0; p < mean.size(); ++p) {
    if (mean[p] >= 0)
      result.image.data[p] = static_cast<gart::u8>(std::lround(255 - 215 * (mean[p] - nearest) / range));
  }
  result.nearest = nearest, result.farthest = farthest;
  return result;
}

int run_render(render_arguments const& a) {
  gart::model_file file = gart::load_model(a.model);
  auto cameras = gart::load_cameras(a.cameras);
  if (cameras.empty()) throw gart::io_error(a.cameras.string(), "has no cameras", "name a dataset or a camera JSON");
  prepare_folder(a.out);
  if (!a.json.empty()) prepare_file(a.json);

  auto const renderer = gart::make_renderer(configuration_request_for(file, a.model, a.configuration.request()));
  renderer->set_model(file.model);
  gart::render_options options = file.render;
  options.background = background_color(a.background);
  if (a.alpha_min >= 0) options.alpha_min = a.alpha_min;
  if (a.t_min >= 0) options.transmittance_min = a.t_min;
  if (a.max_hits >= 0) options.max_hits = static_cast<gart::u32>(a.max_hits);

  gart::exposure_field const exposures =
      a.exposures.empty() ? gart::exposure_field() : gart::read_exposures(a.exposures);

  progress say(a.quiet);
  auto const configuration = renderer->configuration();
  nlohmann::json timings = {{"backend", gart::to_string(configuration.backend)},
                            {"tracer", gart::to_string(configuration.tracer)},
                            {"gaussians", file.model.size()},
                            {"approximations", approximations_of(options.approximations(), configuration)},
                            {"samples", a.samples},
                            {"views", nlohmann::json::array()}};
  renderer->profile().enable(!a.json.empty());
  double total = 0;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    auto& [name, view] = cameras[i];
    if (!a.camera.empty()) view = gart::seen_through(view, a.camera);
    if (a.downscale > 1)
      view = gart::resized(view, std::max(1, view.width / a.downscale), std::max(1, view.height / a.downscale));
    auto const start = std::chrono::steady_clock::now();
    gart::rendered image = render_samples(*renderer, view, options, a.samples);
    if (!exposures.empty()) apply(exposures.at(view), image.color);
    double const ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    total += ms;
    gart::write_png(a.out / (name + ".png"), gart::to_8bit(image.color));
    nlohmann::json entry = {{"name", name}, {"width", view.width}, {"height", view.height}, {"milliseconds", ms}};
    if (a.depth) {
      auto const depth = picture_depth(image);
      gart::write_png(a.out / (name + "_depth.png"), depth.image);
      entry["depth_nearest"] = depth.nearest, entry["depth_farthest"] = depth.farthest;
    }
    timings["views"].push_back(entry);
    double const share = static_cast<double>(i + 1) / static_cast<double>(cameras.size());
    say.state("rendered " + std::to_string(i + 1) + "/" + std::to_string(cameras.size()) + "  " + fixed(ms, 1) + " ms",
              share);
  }
  if (!a.json.empty()) {
    for (auto const& [label, time] : renderer->profile().stages()) {
      timings["stages_ms"][label] = time.milliseconds / static_cast<double>(cameras.size());
    }
    timings["peak_bytes"] = renderer->peak_bytes();
    write_json(a.json, timings);
  }
  say.clear();
  if (!a.quiet) {
    std::printf("%zu views in %s, %.1f ms each (%s, %s)\n", cameras.size(), a.out.string().c_str(),
                total / static_cast<double>(cameras.size()), gart::to_string(configuration.backend),
                gart::to_string(configuration.tracer));
  }
  return 0;
}

}  // namespace

void add_render(CLI::App& app, command& selected) {
  auto a = std::make_shared<render_arguments>();
  CLI::App* render = app.add_subcommand("render", "Render a model from every camera of a dataset or a camera file.");
  render->add_option("MODEL", a->model, "Gaussians in any format, from gart or another program")
      ->type_name("")
      ->required();
  render
      ->add_option("CAMERAS", a->cameras,
                   "A dataset (all its views), or a JSON list of {\"name\", \"width\",\n"
                   "\"height\", \"fx\", \"fy\", \"cx\", \"cy\", \"c2w\"}, in pixels, camera to world\nwith x right, y "
                   "down, z forward")
      ->type_name("")
      ->required();
  render->add_option("--out", a->out, "Folder of the images; made where there is none")->type_name("DIR")->required();
  render
      ->add_option("--camera", a->camera,
                   "Through another camera in the same places: COLMAP's name of a\nmodel and its parameters, as "
                   "EQUIRECTANGULAR, FISHEYE,angle=200 or\nOPENCV_FISHEYE,fx=90,k1=0.02; angle is across the shorter "
                   "side")
      ->type_name("MODEL");
  add_exposures(*render, a->exposures);
  render->add_option("--background", a->background, "black or white: what it was trained on")
      ->type_name("NAME")
      ->capture_default_str()
      ->check(one_of({"black", "white"}));
  render->add_option("--downscale", a->downscale, "Shrink images by this whole factor")
      ->type_name("N")
      ->capture_default_str()
      ->check(between(1, 64));
  render
      ->add_option("--samples", a->samples,
                   "Rays a pixel each way, N x N in all: the mean over the pixel\nitself, in N x N times the time")
      ->type_name("N")
      ->capture_default_str()
      ->check(between(1, 64));
  render
      ->add_option("--alpha-min", a->alpha_min,
                   "Opacity below which a Gaussian is not hit, 0 to 1\n(default: what the model says, else 1/255)")
      ->type_name("A")
      ->check(between(1e-6, 0.99));
  render
      ->add_option("--t-min", a->t_min,
                   "Transmittance below which a ray ends, 0 to 1\n(default: what the model says, else 1e-4)")
      ->type_name("T")
      ->check(between(0, 0.99));
  add_max_hits(*render, a->max_hits);
  render->add_flag("--depth", a->depth, "Also the depth of each view, nearest white, as NAME_depth.png");
  render->add_option("--json", a->json, "Write timings of each view and stage in milliseconds")->type_name("FILE");
  render->add_flag("--quiet", a->quiet, "Say nothing but errors");
  add_configuration_options(*render, a->configuration);
  render->footer(
      "\nWrites DIR/NAME.png for each camera, NAME as the dataset or file has it. The first view pays for the start.\n"
      "\nExamples:\n"
      "  gart render run/model.ply lego --out images --background white\n"
      "  gart render scene.ply path.json --out frames --depth --json timings.json");
  render->callback([a, &selected] { selected = [a] { return run_render(*a); }; });
}

}  // namespace gart_cli
