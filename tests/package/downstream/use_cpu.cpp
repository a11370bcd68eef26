// gart::cpu: writes a capture and trains on it on both host policies; leaves the capture and a model for the examples.
#include <gart/io/file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/ply.hpp>
#include <gart/runtime/session.hpp>

#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>

// Six cameras on a circle around the origin, all seeing the same grey, in Blender's layout.
void write_capture(std::filesystem::path const& folder) {
  for (char const* split : {"train", "test"}) {
    std::filesystem::create_directories(folder / split);
    std::string frames;
    for (int i = 0; i < 6; ++i) {
      std::string const name = std::string(split) + "/r_" + std::to_string(i);
      gart::write_png(folder / (name + ".png"), gart::image8(64, 64, 4, 128));
      frames += (i ? "," : "") + ("{\"file_path\": \"./" + name + "\", \"transform_matrix\": [[1,0,0,") +
                std::to_string(0.1 * i) + "],[0,1,0,0],[0,0,1,4],[0,0,0,1]]}";
    }
    gart::write_file(folder / ("transforms_" + std::string(split) + ".json"),
                     "{\"camera_angle_x\": 0.7, \"frames\": [" + frames + "]}");
  }
}

int main(int argc, char** argv) try {
  if (argc != 3) return 2;
  write_capture(argv[1]);
  gart::dataset const data = gart::load_dataset(argv[1]);
  gart::train_options options;
  options.iterations = 3;
  options.random_points = 500;
  for (gart::backend_kind const backend : {gart::backend_kind::serial, gart::backend_kind::openmp}) {
    gart::configuration_request request;
    request.backend = backend;
    auto const training = gart::make_session(request, options, data);
    while (training->steps_done() < options.iterations) training->step();
    gart::write_splat_ply(argv[2], training->model());
    std::printf("%s: %zu Gaussians\n", to_string(training->configuration().backend),
                gart::read_splat_ply(argv[2]).size());
  }
  return 0;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "use_cpu: %s\n", e.what()), 1;
}
