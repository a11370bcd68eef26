#include "commands.hpp"
#include "image_writer.hpp"
#include "options.hpp"
#include "output.hpp"
#include "progress.hpp"
#include "ranks.hpp"
#include "render_images.hpp"
#include "render_scene.hpp"
#include "run_folder.hpp"
#include "samples.hpp"
#include "timing.hpp"

#include <gart/io/camera_file.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/exposure_file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/view/camera_path.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>
#include <limits>
#include <memory>

namespace gart_cli {

namespace {

namespace fs = std::filesystem;

struct render_arguments {
  fs::path model, cameras, path, out, json, exposures;
  configuration_options configuration;
  scene_options scene;
  std::string background = "auto", camera;
  int downscale = 1, samples = 0, frames = 0;
  bool closed = false;
  float alpha_min = -1, transmittance_min = -1;
  int max_hits = -1;
  image_choice images;
  bool depth = false, quiet = false;
};

// The times of the path's keyframes, from 0 on. Each in the file has a "time" in seconds, as the viewer saves it. A
// closed path ends one mean interval after the last.
std::vector<double> times_of(fs::path const& keyframes, bool closed) {
  std::ifstream file(keyframes);
  nlohmann::json const all = nlohmann::json::parse(file, nullptr, false);
  std::vector<double> times;
  auto const has_time = [](auto const& key) { return key.is_object() && key.contains("time"); };
  if (!all.is_array() || std::none_of(all.begin(), all.end(), has_time)) return times;
  for (auto const& key : all) {
    if (!has_time(key) || !key["time"].is_number())
      throw gart::io_error(keyframes.string() + ", camera " + std::to_string(times.size()),
                           "has no number \"time\", and other keyframes have one",
                           "give each keyframe a time, or none");
    times.push_back(key["time"].get<double>() - (times.empty() ? 0 : all[0]["time"].get<double>()));
  }
  if (times.size() < 2) return {};
  times.front() = 0;
  if (closed) times.push_back(times.back() + times.back() / static_cast<double>(times.size() - 1));
  for (std::size_t i = 1; i < times.size(); ++i)
    if (!(times[i] > times[i - 1]))
      throw gart::io_error(keyframes.string(), "has a \"time\" that is not after the one before it",
                           "give keyframes in their order, or no times");
  return times;
}

std::string frame_name(std::size_t number) {
  char name[32];
  std::snprintf(name, sizeof name, "frame_%05zu", number);
  return name;
}

// The cameras of the file, or the frames of the path through the keyframes' file.
std::vector<gart::named_camera> cameras_of(render_arguments const& a) {
  if (a.path.empty() == a.cameras.empty())
    throw usage_error(
        a.path.empty() ? "CAMERAS is missing: name a dataset or a camera JSON, or --path FILE (see gart render --help)"
                       : "CAMERAS and --path: give one of both");
  if (a.path.empty()) {
    if (a.frames > 0 || a.closed) throw usage_error("--frames and --closed are of a --path: name its keyframes");
    return gart::load_cameras(a.cameras);
  }
  if (a.frames < 2) throw usage_error("--path: how many frames? (give --frames 2 or more)");
  std::vector<gart::camera> keyframes;
  for (gart::named_camera const& c : gart::load_cameras(a.path)) keyframes.push_back(c.view);
  std::vector<gart::named_camera> cameras;
  for (gart::camera const& view : gart::smooth_path(keyframes, a.frames, a.closed, times_of(a.path, a.closed)))
    cameras.push_back({frame_name(cameras.size()), view});
  return cameras;
}

// With a scene that names its models the one file is that of the cameras. So is a folder or a list of them.
void settle_files(render_arguments& a) {
  if (a.scene.file.empty()) {
    a.scene.require_none(a.model, "render");
    for (char const* name : {"albedo", "surface", "ids"})
      if (a.images.has(name)) throw usage_error(std::string("--images ") + name + " is of a --scene");
    return;
  }
  if (a.images.has("hits")) throw usage_error("--images hits: paths of light count no hits (leave one of them out)");
  bool const named = !gart::read_scene_splats(a.scene.file).empty();
  bool const cameras = fs::is_directory(a.model) || a.model.extension() == ".json";
  if (a.cameras.empty() && (named || cameras)) std::swap(a.model, a.cameras);
}

// How views are drawn: Gaussians alone, or paths of light through a scene.
struct drawing {
  gart::configuration_info configuration;
  std::function<gart::rendered(gart::camera const&, gart::render_options const&)> draw;
  gart::profiler* profile = nullptr;
  std::function<std::size_t()> peak_bytes;
};

drawing drawing_of(gart::renderer& renderer, int samples) {
  return {renderer.configuration(),
          [&renderer, samples](auto const& view, auto const& options) {
            return render_samples(renderer, view, options, samples);
          },
          &renderer.profile(), [&renderer] { return renderer.peak_bytes(); }};
}

// Layers take another trace, where an image needs them.
drawing drawing_of(path_scene& scene, int samples, image_choice const& images) {
  auto const& names = image_choice::names();
  bool const layers = std::any_of(names.begin(), names.end(),
                                  [&](std::string const& name) { return name != "colour" && images.has(name); });
  return {scene.renderer().configuration(),
          [&scene, samples, layers](auto const& view, auto const& options) {
            return scene.draw(view, options, samples, layers);
          },
          &scene.renderer().profile(), [] { return std::size_t{0}; }};
}

// What each rank has drawn, in the order of the cameras, with the stages' mean.
nlohmann::json of_all_ranks(nlohmann::json const& mine, std::size_t cameras) {
  std::vector<nlohmann::json> parts;
  for (std::string const& text : ranks::gathered(mine.dump())) parts.push_back(nlohmann::json::parse(text));
  nlohmann::json all = parts.front();
  all["views"] = nlohmann::json::array();
  for (std::size_t i = 0; i < cameras; ++i) all["views"].push_back(parts[i % parts.size()]["views"][i / parts.size()]);
  if (parts.size() > 1) all["ranks"] = parts.size();
  for (auto& [label, time] : all["stages_ms"].items()) {
    double sum = 0;
    for (auto const& part : parts) sum += part["stages_ms"].value(label, 0.0);
    time = sum / static_cast<double>(cameras);
  }
  return all;
}

int run_render(render_arguments a) {
  settle_files(a);
  if (ranks::built) ranks::start(false);
  bool const speaks = ranks::rank() == 0;
  image_choice images = a.images;
  if (a.depth && !images.has("depth")) images.images += ",depth";
  check_images(images);
  if (a.samples > 64 && a.scene.file.empty())
    throw usage_error("--samples " + std::to_string(a.samples) + ": 64 rays each way are the most");
  if (images.has("hits") && a.samples > 1)
    throw usage_error("--images hits: a mean over --samples counts no hits (leave one of them out)");
  bool const has_scene = !a.scene.file.empty();
  std::unique_ptr<path_scene> scene;
  if (has_scene) scene = std::make_unique<path_scene>(a.scene, a.model, a.configuration);
  int const samples = a.samples > 0 ? a.samples : has_scene ? scene->samples() : 1;
  auto cameras = has_scene && a.cameras.empty() && a.path.empty() && !scene->file().cameras.empty()
                     ? scene->file().cameras
                     : cameras_of(a);
  gart::model_file const file = has_scene ? scene->model() : gart::load_model(a.model);
  for (auto& [name, view] : cameras) view.position -= file.origin;
  if (cameras.empty()) throw gart::io_error(a.cameras.string(), "has no cameras", "name a dataset or a camera JSON");
  prepare_folder(a.out);
  if (!a.json.empty() && speaks) prepare_file(a.json);

  std::unique_ptr<gart::renderer> renderer;
  if (!has_scene) {
    renderer = gart::make_renderer(configuration_request_for(file, a.model, a.configuration.request()));
    renderer->set_model(file.model);
  }
  drawing const how = has_scene ? drawing_of(*scene, samples, images) : drawing_of(*renderer, samples);
  gart::render_options options = file.render;
  options.background = background_color(a.background != "auto" ? a.background : background_of_run(a.model));
  if (has_scene && a.background == "auto" && scene->file().background) options.background = *scene->file().background;
  if (a.alpha_min >= 0) options.alpha_min = a.alpha_min;
  if (a.transmittance_min >= 0) options.transmittance_min = a.transmittance_min;
  if (a.max_hits >= 0) options.max_hits = static_cast<gart::u32>(a.max_hits);

  gart::exposure_field const exposures =
      a.exposures.empty() ? gart::exposure_field() : gart::read_exposures(a.exposures, file.origin);

  progress say(a.quiet || !speaks);
  say.notes(file.notes);
  if (has_scene) say.notes(scene->file().notes);
  gart::configuration_info const& configuration = how.configuration;
  nlohmann::json timings = {{"backend", gart::to_string(configuration.backend)},
                            {"tracer", gart::to_string(configuration.tracer)},
                            {"gaussians", file.model.size()},
                            {"approximations", approximations_of(options, configuration)},
                            {"samples", samples},
                            {"stages_ms", nlohmann::json::object()},
                            {"views", nlohmann::json::array()}};
  how.profile->enable(!a.json.empty());
  image_writer files;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    if (!ranks::takes(i)) continue;
    auto& [name, view] = cameras[i];
    if (!a.camera.empty()) view = through_camera(view, a.camera);
    if (a.downscale > 1) view = gart::downscaled(view, a.downscale, "the camera " + name);
    stopwatch const drawn;
    gart::rendered image = how.draw(view, options);
    if (!exposures.empty()) apply(exposures.at(view), image.color);
    double const ms = drawn.milliseconds();
    if (images.has("colour")) files.png(a.out / (name + ".png"), gart::to_8bit(image.color));
    nlohmann::json entry = {{"name", name}, {"width", view.width}, {"height", view.height}, {"milliseconds", ms}};
    write_images(a.out, name, image, view, images, entry);
    if (has_scene) write_layers(a.out, name, scene->layers(), images);
    timings["views"].push_back(entry);
    double const share = static_cast<double>(i + 1) / static_cast<double>(cameras.size());
    say.state("rendered " + std::to_string(i + 1) + "/" + std::to_string(cameras.size()) + "  " + fixed(ms, 1) + " ms",
              share);
  }
  files.finish();
  if (fs::path const next = a.out / (frame_name(cameras.size()) + ".png"); !a.path.empty() && fs::exists(next))
    say.note("NOTE: " + next.string() + " is of an earlier, longer film: remove it and what follows it");
  for (auto const& [label, time] : how.profile->stages()) timings["stages_ms"][label] = time.milliseconds;
  timings["peak_bytes"] = ranks::largest(how.peak_bytes());
  timings = of_all_ranks(timings, cameras.size());
  if (!speaks) return 0;
  if (!a.json.empty()) write_json(a.json, timings);
  say.clear();
  if (!a.quiet) {
    double total = 0;
    for (auto const& view : timings["views"]) total += view["milliseconds"].get<double>();
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
  add_model(*render, a->model);
  add_open(*render, "CAMERAS", a->cameras, "",
           "A dataset (all its views), or a JSON list of {\"name\", \"width\",\n"
           "\"height\", \"fx\", \"fy\", \"cx\", \"cy\", \"c2w\"}, in pixels, camera to world\nwith x right, y "
           "down, z forward");
  add_open(*render, "--path", a->path, "FILE",
           "In place of CAMERAS: keyframes, as a camera JSON. The images are\nframe_00000 and so on along a "
           "smooth path through them. A \"time\" of each\nkeyframe says when, as the viewer saves it");
  add_open(*render, "--frames", a->frames, "N", "Images along --path, evenly in time")->check(between(2, 1e6));
  render->add_flag("--closed", a->closed, "--path goes on from the last keyframe to the first");
  add_open(*render, "--out", a->out, "DIR", "Folder of the images; made where there is none")->required();
  add_open(*render, "--camera", a->camera, "MODEL",
           "Through another camera in the same places: COLMAP's name of a\nmodel and its parameters, as "
           "EQUIRECTANGULAR, FISHEYE,angle=200 or\nOPENCV_FISHEYE,fx=90,k1=0.02; angle is across the shorter "
           "side");
  add_exposures(*render, a->exposures);
  add_value(*render, "--background", a->background, "NAME",
            "black or white. auto: by the config.json of a run beside the\nmodel, else black")
      ->check(one_of({"auto", "black", "white"}));
  add_downscale(*render, a->downscale);
  add_open(*render, "--samples", a->samples, "N",
           "Rays a pixel each way, N x N in all: the mean over the pixel\nitself, in N x N times the time. Of "
           "--scene: paths a pixel\n(default: 1; of a scene what it says, else 16)")
      ->check(between(1, 65536));
  add_open(*render, "--alpha-min", a->alpha_min, "A",
           "Opacity below which a Gaussian is not hit, 0.000001 to 0.99\n(default: what the model says, else 1/255)")
      ->check(between(1e-6, 0.99));
  add_open(*render, "--transmittance-min", a->transmittance_min, "T",
           "Transmittance below which a ray ends, 0 to 0.99\n(default: what the model says, else 1e-4)")
      ->check(between(0, 0.99));
  add_max_hits(*render, a->max_hits);
  add_value(*render, "--images", a->images.images, "LIST",
            "Which images, by commas: colour (NAME.png), depth (mean distance\nalong the ray, 0 where less than "
            "half is seen), normal (of the\ndepth, in the world's axes, (n + 1) / 2), alpha, hits (Gaussians "
            "met):\nNAME_depth.png and so on; depth and hits of 16 bits, with a\nNAME_depth_preview.png in "
            "colours. Of --scene also albedo, surface (its normals), and ids of\nGaussian, mesh and triangle");
  add_value(*render, "--format", a->images.format, "NAME",
            "Of all but colour: png, or floats as they are: npy, or exr, which\nhas the colour too, NAME.exr")
      ->check(one_of({"png", "npy", "exr"}));
  add_value(*render, "--depth-unit", a->images.depth_unit, "U", "Distance of a step of NAME_depth.png")
      ->check(between(1e-9, 1e9));
  render->add_flag("--depth", a->depth, "The depth too: adds it to --images");
  add_open(*render, "--json", a->json, "FILE", "Write timings of each view and stage in milliseconds");
  add_quiet(*render, a->quiet);
  add_scene_options(*render, a->scene);
  add_configuration_options(*render, a->configuration);
  render->footer(
      "\nWrites DIR/NAME.png for each camera, NAME as the dataset or file has it. The first view pays for the start.\n"
      "\nExamples:\n"
      "  gart render run/model.ply lego --out images --background white\n"
      "  gart render scene.ply path.json --out frames --images colour,depth,normal --json timings.json\n"
      "  gart render --scene scene.json --out images --samples 64 --tone-map filmic\n"
      "  gart render run/model.ply --path keyframes.json --frames 240 --out film\n"
      "  ffmpeg -framerate 30 -i film/frame_%05d.png film.mp4      makes a video of it");
  render->callback([a, render, &selected] { selected = [a] { return run_render(*a); }; });
}

}  // namespace gart_cli
