#include "render_scene.hpp"

#include "commands.hpp"

namespace gart_cli {

namespace fs = std::filesystem;

void add_scene_options(CLI::App& app, scene_options& o) {
  add_open(app, "--scene", o.file, "FILE",
           "Paths of light through Gaussians, meshes and lights: a scene.json,\nor a mesh (.glb, .gltf, .obj, "
           ".ply). MODEL is left out where the\nscene names its models, CAMERAS where it has cameras");
  add_open(app, "--bounces", o.bounces, "N",
           "Of --scene: surfaces that a path goes on from\n(default: the scene's, else 4)")
      ->check(between(0, 64));
  add_open(app, "--shadows", o.shadows, "KIND",
           "Of --scene: shadows of meshes on Gaussians, none, per-gaussian (one\nvisibility each and light) or "
           "per-hit (sharper, slower)")
      ->check(name_of_a<gart::light::shadow_kind>());
  add_open(app, "--aperture", o.aperture, "R", "Of --scene: radius of the lens, world units; 0: all is sharp")
      ->check(between(0, 1e9));
  add_open(app, "--focus", o.focus, "D", "Of --scene: distance along the axis that is sharp")
      ->check(between(1e-9, 1e9));
  add_open(app, "--exposure", o.exposure, "S", "Of --scene: stops that the picture is made brighter by")
      ->check(between(-30, 30));
  add_open(app, "--tone-map", o.tone_map, "NAME", "Of --scene: none, srgb or filmic, from light to what a screen shows")
      ->check(name_of_a<gart::light::tone_kind>());
  add_open(app, "--seed", o.seed, "N", "Of --scene: of all that is random");
}

void scene_options::require_none(fs::path const& model, char const* command) const {
  for (auto const& [flag, given] : {std::pair{"--bounces", bounces.has_value()},
                                    {"--shadows", !shadows.empty()},
                                    {"--aperture", aperture.has_value()},
                                    {"--focus", focus.has_value()},
                                    {"--exposure", exposure.has_value()},
                                    {"--tone-map", !tone_map.empty()},
                                    {"--seed", seed.has_value()}})
    if (given) throw usage_error(std::string(flag) + " is of a scene: name it by --scene FILE");
  if (model.empty()) throw usage_error(std::string("MODEL is missing (see gart ") + command + " --help)");
}

path_scene::path_scene(scene_options const& o, fs::path const& model, configuration_options const& configuration) {
  std::vector<gart::placed_splats> splats = gart::read_scene_splats(o.file);
  if (!model.empty()) splats.insert(splats.begin(), gart::placed_splats{.file = model});
  model_ = gart::load_models(splats);
  file_ = gart::read_scene(o.file, model_.origin);
  gart::light::path_options& p = file_.paths;
  if (o.bounces) p.bounces = *o.bounces;
  if (o.seed) p.seed = *o.seed;
  if (!o.shadows.empty()) p.shadows = gart::from_string<gart::light::shadow_kind>(o.shadows);
  if (!o.tone_map.empty()) p.tone = gart::from_string<gart::light::tone_kind>(o.tone_map);
  if (o.aperture) p.aperture = *o.aperture;
  if (o.focus) p.focus = *o.focus;
  if (o.exposure) p.exposure = *o.exposure;
  if (model_.render.antialias > 0) {
    model_.render.antialias = 0;
    file_.notes.push_back("paths of light are traced without the filter that the model was trained with (antialias)");
  }
  gart::configuration_request wanted = configuration.request();
  wanted.sh_degree = model_.model.sh_degree, wanted.kernel_degree = model_.kernel_degree;
  renderer_ = gart::make_path_renderer(wanted);
  renderer_->set_model(model_.model);
  try {
    gart::light::require_path_options(p);
    renderer_->set_scene(file_.scene);
  } catch (gart::invalid_argument const& e) {
    throw gart::io_error(o.file.string(), e.what(), "correct it");
  }
}

gart::rendered path_scene::draw(gart::camera const& view, gart::render_options options, int samples, bool with_layers) {
  gart::light::path_options paths = file_.paths;
  paths.samples = samples;
  renderer_->begin(view, options, paths);
  renderer_->add(samples);
  gart::rendered out;
  if (with_layers) out = gart::depth_of(layers_ = renderer_->layers());
  out.color = renderer_->picture();
  return out;
}

}  // namespace gart_cli
