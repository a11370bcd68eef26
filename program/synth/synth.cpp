#include "commands.hpp"
#include "options.hpp"
#include "progress.hpp"
#include "synth_capture.hpp"
#include "timing.hpp"

#include <gart/io/origin.hpp>

#include <cstdio>
#include <memory>

namespace gart_cli {
namespace {

// The camera and the origin are texts, which the command line does not check.
void check_texts(synth_options const& options) {
  if (!options.camera.empty()) through_camera(synth_cameras(1, options.size, false)[0], options.camera);
  if (options.origin.empty()) return;
  try {
    gart::origin_of({{"origin", options.origin}}, "--origin");
  } catch (gart::error const&) {
    throw usage_error("--origin " + options.origin + ": is not three numbers (give X,Y,Z, as 500000,4000000,100)");
  }
}

int run_synth(synth_options const& options, bool quiet) {
  check_texts(options);
  stopwatch const whole;
  progress say(quiet);
  write_synth_capture(options, [&](int done, int total) {
    say.state("view " + std::to_string(done) + "/" + std::to_string(total) + "  " +
                  as_duration(whole.seconds() * (total - done) / done) + " left",
              static_cast<double>(done) / total);
  });
  say.clear();
  if (!quiet)
    std::printf("%s: %d train and %d test views of %d x %d, %d points, in %.1f s\n", options.out.c_str(), options.train,
                options.test, options.size, options.size, options.points, whole.seconds());
  return 0;
}

}  // namespace

void add_synth(CLI::App& app, command& selected) {
  auto options = std::make_shared<synth_options>();
  auto quiet = std::make_shared<bool>(false);
  CLI::App* synth = app.add_subcommand(
      "synth", "Make a small capture with no outside data: path traced views of textured, glossy and thin meshes.");
  add_open(*synth, "--out", options->out, "DIR", "Folder of the capture: new, empty, or an earlier one of synth")
      ->required();
  auto const count = [synth](char const* name, int& value, synth_limits limits, char const* description) {
    add_value(*synth, name, value, "N", description)->check(between(limits.low, limits.high));
  };
  count("--train", options->train, synth_views, "Views to train on, spread over the upper hemisphere");
  count("--test", options->test, synth_views, "Views to test on, between the others");
  count("--size", options->size, synth_size, "Width and height of a view, in pixels");
  count("--samples", options->samples, synth_samples,
        "Paths a pixel: noise falls with their number, time grows\nwith it");
  count("--points", options->points, synth_points, "Starting points, on surfaces that the train views see");
  count("--threads", options->threads, synth_threads, "Threads to render with; 0: all of the machine's");
  add_value(*synth, "--seed", options->seed, "N",
            "Another seed places other leaves and draws other noise; the\nsame seed gives the same files, for any "
            "number of threads")
      ->check(whole_number());
  add_open(*synth, "--camera", options->camera, "MODEL",
           "Through another camera than a pinhole: COLMAP's name of a model\nand its parameters, as "
           "EQUIRECTANGULAR, FISHEYE,angle=200 or\nOPENCV_FISHEYE,k1=0.02; angle is across a view. "
           "ORTHOGRAPHIC,\nextent=2.7 has parallel rays, 2.7 world units across");
  add_value(*synth, "--rolling", options->rolling, "DEGREES",
            "Train views through a rolling shutter: row after row while the\ncamera turns by so many degrees, "
            "and travels; 0 to 90")
      ->check(between(0, synth_rolling_most));
  add_open(*synth, "--origin", options->origin, "X,Y,Z",
           "Add this to all coordinates, as of a survey: 500000,4000000,100");
  synth->add_flag("--depth", options->depth,
                  "Also a depth map of each view, r_N_depth.png: distances along\nthe rays, for gart train "
                  "--depth-weight");
  synth->add_flag("--mesh", options->mesh, "Also the scene itself, mesh.ply, for gart mesh --against");
  auto const mirror = std::make_shared<std::string>("none");
  add_value(*synth, "--mirror", *mirror, "KIND",
            "A mirror stands in the scene, plane or ball; also scene.json, which\nsays where, for gart train "
            "--scene and gart render --scene")
      ->check(name_of_a<synth_mirror>());
  add_quiet(*synth, *quiet);
  synth->footer(
      "Writes DIR/transforms_train.json and DIR/transforms_test.json (Blender's layout), DIR/train/r_N.png and\n"
      "DIR/test/r_N.png (RGBA, transparent where there is no surface) and DIR/points3d.ply. Needs Embree.\n\n"
      "Examples:\n"
      "  gart synth --out out/still\n"
      "      the capture of the quick start; then: gart train out/still --out out/model\n"
      "  gart synth --out out/large --train 120 --test 20 --size 400 --samples 256 --points 50000\n"
      "      more, larger and cleaner views, for a GPU\n");
  synth->callback([options, quiet, mirror, &selected] {
    options->mirror = gart::from_string<synth_mirror>(*mirror);
    selected = [options, quiet] { return run_synth(*options, *quiet); };
  });
}

}  // namespace gart_cli
