#include "train_arguments.hpp"

#include "capture_checksum.hpp"
#include "commands.hpp"
#include "output.hpp"
#include "train_fields.hpp"

#include <gart/core/version.hpp>
#include <gart/io/crc32c.hpp>
#include <gart/io/file.hpp>
#include <gart/runtime/capture_defaults.hpp>
#include <gart/train/option_fields.hpp>

#include <cmath>
#include <cstdio>

namespace gart_cli {

namespace fs = std::filesystem;

namespace {

// The option of a field that has one. A search for numbers that are not finite changes no result, and is not recorded.
void add_field(CLI::App& train, train_arguments& a, gart::option_field const& field) {
  std::string const flag = flag_of(field);
  std::string const help =
      std::string(field.help) + (flag == "--iterations"
                                     ? ". With --resume it may be\nraised: rates, degrees and densification then "
                                       "follow the new\nlength, so rates that had fallen rise again"
                                     : "");
  std::visit(
      [&](auto at) {
        auto& value = at(a.options);
        using type = std::remove_reference_t<decltype(value)>;
        CLI::Option* option = nullptr;
        if constexpr (std::is_same_v<type, bool>) {
          option = flag == "--check-finite" ? train.add_flag(flag, value, help)
                                            : a.recorded.add_flag(train, flag, value, help);
        } else {
          option = a.recorded.add(train, flag, value, std::is_floating_point_v<type> ? "X" : "N", help);
          option->check(std::is_same_v<type, gart::u64> ? whole_number() : between(field.low, field.high));
        }
        option->group(std::string(field.group));
      },
      field.of);
}

// Runs of a gart that wrote none are from zero.
gart::vec3d origin_in(nlohmann::json const& config, fs::path const& file) {
  gart::vec3d origin(0.0);
  if (!config.contains("origin")) return origin;
  nlohmann::json const& list = config["origin"];
  for (std::size_t k = 0; k < 3; ++k) {
    bool const there = list.is_array() && list.size() == 3 && list[k].is_number();
    double const v = there ? list[k].get<double>() : 0;
    if (!there || !(std::abs(v) <= 1e18))
      throw gart::io_error(file.string(), "'origin' is not a list of 3 numbers",
                           "write that of the run's model.ply, or start anew without --resume");
    origin[static_cast<int>(k)] = v;
  }
  return origin;
}

}  // namespace

void add_arguments(CLI::App& train, train_arguments& a) {
  auto& r = a.recorded;
  add_open(train, "DATASET", a.dataset, "",
           "Capture: a folder with COLMAP's sparse/ and images/, Blender's\n"
           "transforms_train.json, or a transforms.json; or such a file");
  add_open(train, "--out", a.out, "DIR", "Folder of the results; made if missing")->required();
  train.add_flag("--resume", a.resume,
                 "Continue the run in DIR from its last checkpoint, with its\noptions; DATASET may be left out");
  add_quiet(train, a.quiet);

  std::string group = "Training";
  auto const in_group = [&group](CLI::Option* option) { return option->group(group); };
  for (gart::option_field const& field : gart::option_fields)
    if (!flag_of(field).empty()) add_field(train, a, field);
  in_group(r.add(train, "--time-budget", a.time_budget, "S",
                 "Seconds of training after which the run ends, where\n--iterations do not end it before, 0: no limit. "
                 "Rates, degrees\nand densification go by the larger of both shares. Such a run\ndepends on the "
                 "machine and its load, whatever the seed. It may\nbe raised as --iterations may"))
      ->check(between(0, 1e9));
  in_group(r.add(train, "--densify", a.densify, "NAME",
                 "How Gaussians are added: error (those split through which\nthe image's error is seen, up to "
                 "--max-gaussians), mcmc\n(copies by opacity, random steps), adc (clones and splits by\ngradient) or "
                 "none;\nauto: error"))
      ->check(one_of({"auto", "error", "mcmc", "adc", "none"}));
  in_group(r.add_flag(train, "--auto,!--no-auto", a.automatic,
                      "Measure what the capture asks for before the run: settings\nleft open are tried in short "
                      "trainings on small images, and\ntraining views held out of them judge (docs/training.md).\n"
                      "--no-auto: the usual settings, the same for all"));
  in_group(r.add(train, "--sh-degree", a.sh_degree, "0..3", "Degree of the spherical harmonics of colour"))
      ->check(between(0, 3));
  in_group(r.add(train, "--adam", a.adam, "NAME",
                 "all: each step moves every Gaussian; seen: only those that\nits view shows, as sparse Adam does; for "
                 "views that show a\nsmall part of a large scene"))
      ->check(one_of({"all", "seen"}));
  in_group(r.add(train, "--set", a.set, "NAME=VALUE,...",
                 "Rules by name, for measuring them: error.growth_end=0.25,\nrates.opacity=0.05 and so on "
                 "(docs/training.md); they are listed\nat the end of --help-all"));
  in_group(r.add(train, "--start", a.start, "MODEL.ply", "Start from these Gaussians instead"));

  in_group(r.add(train, "--kernel-degree", a.kernel_degree, "N",
                 "How Gaussians fall from their centres, exp(-4.5 (r / 3)^N):\n2, or 4, as 3DGRT has it"))
      ->check(kernel_degree_names());

  in_group(r.add_flag(
      train, "--antialias", a.antialias,
      "Each pixel sees the Gaussians through a filter of its own\nwidth: for models that are shown smaller or from "
      "farther away\nthan they were trained. The model's file says so"));

  group = "Capture";
  in_group(r.add(train, "--match", a.match, "NAME",
                 "on: start from points matched in the photographs too;\nauto: where the capture has no points, or "
                 "where --auto\nmeasures a gain"))
      ->check(one_of({"auto", "on", "off"}));
  in_group(r.add(train, "--exposure", a.exposure, "NAME",
                 "on: learn the exposure and white balance of each photograph;\ntest views get theirs from the "
                 "training views about them.\nauto: where --auto measures a gain"))
      ->check(one_of({"auto", "on", "off"}));
  in_group(
      r.add(train, "--vignetting", a.vignetting, "NAME",
            "on: learn how much each lens darkens the corners of its\nphotographs; test views get it too. auto: where "
            "--auto measures\na gain"))
      ->check(one_of({"auto", "on", "off"}));
  in_group(r.add(train, "--poses", a.poses, "FILE",
                 "With --refine-poses: begin at the poses of this camera JSON,\nby the views' names, instead of the "
                 "capture's. The poses.json of\na run that found them makes a better scene, and better poses"));
  in_group(
      r.add(train, "--scene", a.scene, "FILE",
            "Mirrors that are known to be in the capture, as meshes of a\nscene.json: what photographs show in them is "
            "learned where it is"));
  in_group(r.add(train, "--downscale", a.downscale, "N", "Shrink images by this whole factor"))->check(between(1, 64));
  in_group(r.add(
      train, "--photos", a.photos, "DIR",
      "The folder that the photographs' names are in (default: where the\ncapture has it, as images beside sparse)"));
  in_group(
      r.add_flag(train, "--no-masks", a.no_masks,
                 "Leave out the masks that the capture names, or that are in a\nfolder masks beside its photographs"));
  in_group(r.add(train, "--background", a.background, "NAME",
                 "white, black, or random (another at each step; tests on black);\nauto: white for transparent "
                 "images and plain white borders,\nelse black"))
      ->check(one_of({"auto", "white", "black", "random"}));
  in_group(
      r.add(train, "--test-every", a.test_every, "N",
            "Keep each Nth view for testing, 0: none; for captures that do\nnot say themselves which are for testing"))
      ->check(between(0, 1e6));
  in_group(
      r.add(train, "--test-split", a.test_split, "NAME",
            "Which views are kept: nth, each Nth by name, or sector, as many\ncameras beside each other, which asks "
            "more of a scene"))
      ->check(name_of_a<gart::split_kind>());

  in_group(r.add(train, "--depth-kind", a.depth_kind, "NAME",
                 "Quantity of the maps: z, along the camera's axis, or\ndistance, along the ray; auto: the capture's "
                 "own, else z"))
      ->check(name_of_a<gart::depth_kind>());
  in_group(r.add(train, "--depth-unit", a.depth_unit, "U",
                 "Length of a step of the maps, in units of the cameras'\npositions; 0: the capture's own, else 0.001 "
                 "for a PNG and 1\nfor a .npy"))
      ->check(between(0, 1e9));

  group = "Machine";
  in_group(r.add(train, "--backend", a.backend, "NAME",
                 "Backend: serial, openmp (CPU) or cuda;\nauto: the fastest there is"))
      ->check(name_of_a<gart::backend_kind>());
  in_group(r.add(train, "--tracer", a.tracer, "NAME",
                 "Tracer: tiles, bvh, embree (CPU), or optix (CUDA);\nthe images are the same"))
      ->check(name_of_a<gart::tracer_kind>());
  in_group(r.add(train, "--backward", a.backward, "NAME",
                 "How gradients are summed: primitive (one sum a Gaussian and\ntile), hybrid (a quarter of the "
                 "memory), pixel, or\ndeterministic (the same bits in every run); auto: the fastest"))
      ->check(one_of_methods());
  in_group(r.add(train, "--hit-memory", a.hit_memory_gb, "GB",
                 "Memory for the records of the forward pass. A step that\nneeds more is done by hybrid, which needs a "
                 "quarter, or else\nby pixel, which needs none. 0: half of the memory free\n"
                 "at the start (deterministic: no limit)"))
      ->check(between(0, 1e6));
  in_group(add_value(train, "--parallel", a.parallel, "NAME",
                     "How ranks share a step (mpirun -n 4 gart train ...,\ndocs/backends.md): strips of one view, "
                     "the training of one\nrank itself, or views, a --batch of one for each"))
      ->check(one_of({"strips", "views"}));
  in_group(add_value(train, "--gpus", a.gpus, "N",
                     "GPUs of this host that train together: starts a rank for\neach, as mpirun -n N gart "
                     "train ... does"))
      ->check(between(1, 1024));
  add_threads(train, a.threads);
  in_group(train.get_option("--threads"));

  group = "Accuracy";
  in_group(r.add(train, "--preset", a.preset, "NAME",
                 "exact, or quick: " + std::to_string(quick_iterations) + " steps, where --iterations is not given"))
      ->check(one_of({"exact", "quick"}));

  in_group(r.add(train, "--hit-format", a.hit_format, "NAME",
                 "Record of a hit for primitive: float4, or half (half the\nmemory, less exact "
                 "gradients)"))
      ->check(name_of_a<gart::hit_format_kind>());

  group = "Course";
  in_group(r.add(train, "--eval-every", a.eval_every, "N",
                 "Steps between tests on the test views, 0: only at the end,\n-1: five in the run"))
      ->check(between(-1, 1e9));
  in_group(add_value(train, "--checkpoint-every", a.checkpoint_minutes, "M",
                     "Minutes between checkpoints, 0: only at the end"))
      ->check(between(0, 1e6));
  in_group(add_value(train, "--stop-at", a.stop_at, "N",
                     "Stop after this step as Ctrl-C would, 0: do not; the run can\nthen be resumed"))
      ->check(between(0, 1e9));

  group = "Viewer";
  in_group(train.add_flag("--view", a.viewed,
                          "Look at the training in a browser, at the addresses printed\n(see gart view --help); pause, "
                          "step, save and stop it there"));
  in_group(add_value(train, "--view-share", a.view_share, "X",
                     "Time that views may take while it trains, as a share of the\ntraining's own; with nobody "
                     "looking they take none"))
      ->check(between(0.01, 1));
  add_view_options(train, a.view, "view-");
  in_group(train.get_option("--view-listen")), in_group(train.get_option("--view-port"));
}

namespace {

// Recorded so, since a run may be resumed from anywhere.
std::string whole_path(std::string const& path) {
  return path.empty() ? path : fs::absolute(path).lexically_normal().string();
}

}  // namespace

void fill_in(CLI::App const& train, train_arguments& a) {
  bool const by_count = train.get_option("--iterations")->count() > 0;
  if (a.preset == "quick" && !by_count) a.options.iterations = quick_iterations;
  a.length_given = by_count || a.preset == "quick" || a.time_budget > 0;
  for (std::string* path : {&a.start, &a.photos, &a.poses, &a.scene}) *path = whole_path(*path);
  gart::train_options by_rules;
  a.set.apply(by_rules);
  bool const by_set = by_rules.render.antialias > 0;
  if (a.options.refine_lens && (a.antialias || by_set))
    throw CLI::ValidationError("--refine-lens", std::string("lenses are not learned with antialiasing (leave ") +
                                                    (by_set ? "--set render.antialias" : "--antialias") + " out)");
}

void continue_run(train_arguments& a) {
  for (auto const& file : {a.config_file(), a.checkpoint_file()}) {
    if (!fs::exists(file)) {
      throw gart::io_error(file.string(), "is not there: --resume needs the folder of a run that was started",
                           "give that run's --out, or leave --resume out");
    }
  }
  nlohmann::json const config = read_json(a.config_file());
  if (!config.is_object() || !config.contains("options") || !config["options"].is_object()) {
    throw gart::io_error(a.config_file().string(), "has no \"options\"", "start anew without --resume");
  }
  nlohmann::json options = config["options"];
  // Names in the files of earlier runs, which have no scene.
  for (auto const& [old, now] :
       {std::pair{"t-min", "transmittance-min"}, {"lt-budget", "hit-memory"}, {"lt-format", "hit-format"}})
    if (options.contains(old)) options.emplace(now, options[old]);
  options.emplace("scene", "");
  for (char const* path : {"start", "photos"})  // earlier runs recorded them as they were typed
    if (options.contains(path) && options[path].is_string()) options[path] = whole_path(options[path]);
  // Runs that recorded --set as text had other defaults, which they keep.
  if (options.contains("set") && options["set"].is_string()) {
    std::string text = options["set"];
    for (std::string const before : {"rates.sh_rest=0.000125", "sh_penalty=0", "error.draw_by_root=0"})
      if (text.find(before.substr(0, before.find('=') + 1)) == std::string::npos)
        text += (text.empty() ? "" : ",") + before;
    options["set"] = text;
  }
  a.raised = a.recorded.continue_from(options, a.config_file(), {"iterations", "time-budget"});
  a.origin = origin_in(config, a.config_file());
  if (a.dataset.empty()) {
    if (!config.contains("dataset") || !config["dataset"].is_string()) {
      throw gart::io_error(a.config_file().string(), "has no \"dataset\"", "name the dataset on the command line");
    }
    a.dataset = fs::path(config["dataset"].get<std::string>());
  }
}

gart::configuration_request configuration_request_of(train_arguments const& a) {
  gart::configuration_request wanted;
  wanted.backend = gart::from_string<gart::backend_kind>(a.backend);
  wanted.tracer = gart::from_string<gart::tracer_kind>(a.tracer);
  wanted.backward = a.backward;
  wanted.sh_degree = a.sh_degree;
  wanted.kernel_degree = a.kernel_degree;
  wanted.hit_format = gart::from_string<gart::hit_format_kind>(a.hit_format);
  wanted.threads = a.threads;
  wanted.depth = a.options.depth_weight > 0;
  return wanted;
}

gart::train_options train_options_of(train_arguments const& a) {
  gart::train_options o = a.options;
  o.random_points = std::min(o.random_points, o.max_gaussians);
  o.densify = gart::from_string(a.densify, o.densify);
  o.match = a.match == "on", o.exposure = a.exposure == "on", o.vignetting = a.vignetting == "on";
  o.adam.sparse = a.adam == "seen";
  o.hit_memory = static_cast<gart::u64>(a.hit_memory_gb * 1e9);
  // Until it is settled it decides nothing.
  o.background = gart::from_string(a.background, gart::background_kind::black);
  o.render.antialias = a.antialias ? gart::default_antialias : 0;
  // The other tracers build no tree, and the images are the same.
  if (a.tracer != gart::to_string(gart::tracer_kind::bvh) && a.tracer != gart::to_string(gart::tracer_kind::optix))
    o.render.rebuild_every = 1;
  a.set.apply(o);
  return o;
}

nlohmann::json config_of(train_arguments const& a, gart::dataset const& data) {
  nlohmann::json config{{"gart", gart::version},
                        {"dataset", fs::absolute(a.dataset).lexically_normal().string()},
                        {"train_views", data.train.size()},
                        {"test_views", data.test.size()},
                        {"checksums", checksums_of(data)},
                        {"origin", {data.origin.x, data.origin.y, data.origin.z}},
                        {"options", a.recorded.values()}};
  // A resumed run must begin at the same poses: its learned ones are from there.
  if (!a.poses.empty()) {
    std::vector<gart::u8> const file = gart::read_file(a.poses);
    config["poses_checksum"] = gart::crc32c(file.data(), file.size());
  }
  return config;
}

void check_same_dataset(train_arguments const& a, gart::dataset const& data) {
  nlohmann::json const config = read_json(a.config_file());
  auto const now = config_of(a, data);
  for (char const* key : {"train_views", "test_views"}) {
    if (config.contains(key) && config[key] == now[key]) continue;
    throw usage_error(a.dataset.string() + ": has " + now[key].dump() + " " + key + ", the run to be resumed had " +
                      config.value(key, nlohmann::json()).dump() + " (" + a.config_file().string() +
                      "; name the dataset it was started with)");
  }
  if (now.value("poses_checksum", nlohmann::json()) != config.value("poses_checksum", nlohmann::json()))
    throw usage_error("--poses " + a.poses + ": is not what the run to be resumed began at (" +
                      a.config_file().string() + "; put that file back, or start anew without --resume)");
  // A run of a gart that wrote none has nothing to compare.
  for (auto const& [what, sum] : now["checksums"].items()) {
    nlohmann::json const before = config.value("checksums", nlohmann::json::object());
    if (!before.is_object() || !before.contains(what) || before[what] == sum) continue;
    throw usage_error(a.dataset.string() + ": its " + what + " are not those that the run to be resumed began with (" +
                      a.config_file().string() + "; put the capture back as it was, or start anew without --resume)");
  }
}

}  // namespace gart_cli
