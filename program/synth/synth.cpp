#include "commands.hpp"
#include "help.hpp"
#include "options.hpp"
#include "synth_capture.hpp"

#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <memory>

namespace gart_cli {
namespace {

// One updating line on a terminal, else a line every quarter.
class progress_line {
 public:
  void operator()(int done, int total) {
    double const seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    double const left = seconds * (total - done) / done;
    if (terminal_) {
      std::fprintf(stderr, "\rsynth: view %d of %d, %.0f s left ", done, total, left);
      if (done == total) std::fprintf(stderr, "\r\033[K");
    } else if (done == total || done * 4 / total != (done - 1) * 4 / total) {
      std::fprintf(stderr, "synth: view %d of %d, %.0f s left\n", done, total, left);
    }
    std::fflush(stderr);
  }

 private:
  bool terminal_ = isatty(STDERR_FILENO) != 0;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

int run_synth(synth_options const& options, bool quiet) {
  auto const start = std::chrono::steady_clock::now();
  progress_line line;
  write_synth_capture(options, quiet ? std::function<void(int, int)>() : std::ref(line));
  if (!quiet) {
    double const seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    std::printf("%s: %d train and %d test views of %d x %d, %d points, in %.1f s\n", options.out.c_str(), options.train,
                options.test, options.size, options.size, options.points, seconds);
  }
  return 0;
}

}  // namespace

void add_synth(CLI::App& app, command& selected) {
  auto options = std::make_shared<synth_options>();
  auto quiet = std::make_shared<bool>(false);
  CLI::App* synth = app.add_subcommand(
      "synth", "Make a small capture with no outside data: path traced views of textured, glossy and thin meshes.");
  synth->add_option("--out", options->out, "Folder of the capture: new, empty, or an earlier one of synth")
      ->type_name("DIR")
      ->required();
  auto const count = [synth](char const* name, int& value, synth_limits limits, char const* description) {
    synth->add_option(name, value, description)
        ->type_name("N")
        ->check(between(limits.low, limits.high))
        ->capture_default_str();
  };
  count("--train", options->train, synth_views, "Views to train on, spread over the upper hemisphere");
  count("--test", options->test, synth_views, "Views to test on, between the others");
  count("--size", options->size, synth_size, "Width and height of a view, in pixels");
  count("--samples", options->samples, synth_samples,
        "Paths a pixel: noise falls with their number, time grows\nwith it");
  count("--points", options->points, synth_points, "Starting points, on surfaces that the train views see");
  count("--threads", options->threads, synth_threads, "Threads to render with; 0: all of the machine's");
  synth
      ->add_option(
          "--seed", options->seed,
          "Another seed places other leaves and draws other noise; the\nsame seed gives the same files, for any "
          "number of threads")
      ->type_name("N")
      ->check(whole_number())
      ->capture_default_str();
  synth
      ->add_option("--camera", options->camera,
                   "Through another camera than a pinhole: COLMAP's name of a model\nand its parameters, as "
                   "EQUIRECTANGULAR, FISHEYE,angle=200 or\nOPENCV_FISHEYE,k1=0.02; angle is across a view. "
                   "ORTHOGRAPHIC,\nextent=2.7 has parallel rays, 2.7 world units across")
      ->type_name("MODEL");
  synth
      ->add_option("--rolling", options->rolling,
                   "Train views through a rolling shutter: row after row while the\ncamera turns by so many degrees, "
                   "and travels")
      ->type_name("DEGREES")
      ->capture_default_str();
  synth->add_option("--origin", options->origin, "Add this to all coordinates, as of a survey: 500000,4000000,100")
      ->type_name("X,Y,Z");
  synth->add_flag("--depth", options->depth,
                  "Also a depth map of each view, r_N_depth.png: distances along\nthe rays, for gart train "
                  "--depth-weight");
  synth->add_flag("--mesh", options->mesh, "Also the scene itself, mesh.ply, for gart mesh --against");
  auto const mirror = std::make_shared<std::string>("none");
  synth
      ->add_option("--mirror", *mirror,
                   "A mirror stands in the scene, plane or ball; also scene.json, which\nsays where, for gart train "
                   "--scene and gart render --scene")
      ->type_name("KIND")
      ->capture_default_str()
      ->check(name_of_a<synth_mirror>());
  synth->add_flag("--quiet", *quiet, "Print nothing but errors");
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
