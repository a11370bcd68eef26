// What it is worth to know a mirror: two trainings of one capture, scored on views that neither saw.
#include <gart/core/error.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/scene_file.hpp>
#include <gart/runtime/session.hpp>

#include <doctest/doctest.h>
#include <synth/synth_capture.hpp>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>

namespace {

using gart::vec3;

struct scratch_folder {
  std::filesystem::path const path =
      std::filesystem::temp_directory_path() / ("gart_mirror_" + std::to_string(getpid()));
  ~scratch_folder() { std::filesystem::remove_all(path); }
};

// Mean of squares over the test views, before white.
double error_of(gart::session& session, gart::dataset const& data) {
  double sum = 0;
  std::size_t count = 0;
  for (gart::dataset_view const& v : data.test) {
    gart::image_float const seen = session.render(v.view, vec3(1.0f)).color;
    for (int y = 0; y < v.view.height; ++y)
      for (int x = 0; x < v.view.width; ++x)
        for (int c = 0; c < 3; ++c) {
          double const alpha = v.image.at(x, y, 3) / 255.0;
          double const truth = alpha * (v.image.at(x, y, c) / 255.0) + 1 - alpha;
          double const off = std::clamp(double{seen.at(x, y, c)}, 0.0, 1.0) - truth;
          sum += off * off, ++count;
        }
  }
  return sum / static_cast<double>(count);
}

}  // namespace

TEST_CASE("training gains by a mirror that is known") {
  scratch_folder const folder;
  gart_cli::synth_options capture;
  capture.out = folder.path, capture.mirror = gart_cli::synth_mirror::ball;
  capture.train = 32, capture.test = 6, capture.size = 48, capture.samples = 16, capture.points = 2000;
  try {
    gart_cli::write_synth_capture(capture);
  } catch (gart::unsupported const& no_embree) {
    MESSAGE("skipped: " << std::string(no_embree.what()));
    return;
  }
  gart::dataset data = gart::load_dataset(capture.out);
  gart::train_options options;
  options.iterations = 300, options.max_gaussians = 3000, options.background = gart::background_kind::white;
  gart::configuration_request request;
  request.backend = gart::backend_kind::openmp, request.threads = 1, request.sh_degree = 2;
  double error[2];
  for (int const known : {0, 1}) {
    if (known) data.mirrors = gart::read_scene(capture.out / "scene.json").scene;
    auto const session = gart::make_session(request, options, data);
    for (int i = 0; i < options.iterations; ++i) session->step();
    error[known] = error_of(*session, data);
  }
  double const gain = 10 * std::log10(error[0] / error[1]);
  CAPTURE(-10 * std::log10(error[0]));
  CHECK(gain > 2.5);  // 4.5 measured
}
