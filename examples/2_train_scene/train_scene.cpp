// Trains on a capture (COLMAP, Blender, nerfstudio) and writes the scene: train_scene DATASET MODEL.ply [ITERATIONS]
#include <gart/runtime/capture_defaults.hpp>
#include <gart/runtime/model_file.hpp>
#include <gart/runtime/session.hpp>

#include <cstdio>
#include <cstdlib>
#include <exception>

int main(int argc, char** argv) try {
  if (argc < 3) return std::fprintf(stderr, "usage: train_scene DATASET MODEL.ply [ITERATIONS]\n"), 2;
  gart::dataset_options reading;
  reading.downscale = 4;
  gart::dataset const data = gart::load_dataset(argv[1], reading);
  gart::train_options options;
  options.iterations = argc > 3 ? std::atoi(argv[3]) : 2000;
  options.max_gaussians = 20'000;

  // Background, exposures and the like as they suit the capture; what should be otherwise is set after this.
  auto const use = gart::recommended(options, data);
  auto const training = gart::make_session(use.request, use.options, data);
  while (training->steps_done() < use.options.iterations) {
    gart::step_report const done = training->step();
    if (done.step % 100 == 0)
      std::printf("%5d  loss %.4f  psnr %.2f dB  %u Gaussians\n", done.step, done.loss, done.psnr, done.gaussians);
  }
  training->save_model(argv[2], gart::traits_of(gart::render_options_of(use.options, data.extent), 2));
  return 0;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "train_scene: %s\n", e.what()), 1;
}
