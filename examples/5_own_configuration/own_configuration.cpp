// Compiles a configuration that gart's libraries have not: Gaussians of kernel degree 4 (flatter inside, steeper at the
// rim) with SH degree 1, on OpenMP. Trains a scene of them and renders it: own_configuration DATASET MODEL.ply
// [ITERATIONS]
#include <gart/exec/parallel.hpp>
#include <gart/io/ply.hpp>
#include <gart/runtime/compiled_configurations.hpp>
#include <gart/trace/tile_tracer.hpp>

#include <cstdio>
#include <cstdlib>
#include <exception>

// Registered when the program starts; from then on make_session and make_renderer know it. In a library the linker has
// to be told to keep the symbol: -Wl,--undefined=own_configurations.
using response = gart::generalized_gaussian<4>;
GART_REGISTER_CONFIGURATIONS(
    own_configurations,
    gart::register_configuration_of<gart::openmp_exec, gart::scene_traits<1, response>,
                                    gart::tile_tracer<gart::openmp_exec, 8, response>, gart::primitive_method>(0))

int main(int argc, char** argv) try {
  if (argc < 3) return std::fprintf(stderr, "usage: own_configuration DATASET MODEL.ply [ITERATIONS]\n"), 2;
  gart::dataset const data = gart::load_dataset(argv[1], {});
  gart::train_options options;
  options.iterations = argc > 3 ? std::atoi(argv[3]) : 2000;
  options.max_gaussians = 20'000;

  gart::configuration_request request;
  request.sh_degree = 1;
  request.kernel_degree = 4;
  auto const training = gart::make_session(request, options, data);
  gart::configuration_info const configuration = training->configuration();
  std::printf("%s, %s, %s: kernel degree %d\n", to_string(configuration.backend), to_string(configuration.tracer),
              configuration.backward.c_str(), configuration.kernel_degree);
  gart::step_report done;
  while (training->steps_done() < options.iterations) done = training->step();
  std::printf("loss %.4f after %d steps, %u Gaussians\n", done.loss, done.step, done.gaussians);
  // The file says what it was trained with: a renderer has to be of the same degree.
  gart::write_splat_ply(argv[2], training->model(), {{"kernel_degree", "4"}});
  return 0;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "own_configuration: %s\n", e.what()), 1;
}
