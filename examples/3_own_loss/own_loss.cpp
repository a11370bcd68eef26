// Training with a loss of one's own: own_loss DATASET MODEL.ply [ITERATIONS]
// Charbonnier's, the mean of sqrt(d^2 + e^2) - e over pixels and channels: quadratic for small differences, L1 for
// large ones. The trainer is a template here, compiled for OpenMP, SH degree 1, the BVH and the pixel backward pass.
#include <gart/backward/gradient_methods.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/io/ply.hpp>
#include <gart/runtime/initial.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/train/trainer.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>

// One index a pixel: dL/d image, and what the pixel adds to the loss and to the mean squared error.
struct charbonnier {
  gart::span<float const> image;
  gart::truth_view truth;
  gart::span<float> gradient;
  gart::span<float> loss, squared;

  GART_KERNEL void operator()(gart::index_t pixel) const {
    constexpr float e = 1e-2f;
    float const share = 1.0f / static_cast<float>(image.size());
    gart::u8 const* const t = truth.pixels + std::size_t{pixel} * truth.channels;
    float const alpha = truth.channels == 4 ? static_cast<float>(t[3]) / 255.0f : 1.0f;
    loss[pixel] = squared[pixel] = 0;
    for (int c = 0; c < 3; ++c) {
      std::size_t const at = std::size_t{pixel} * 3 + c;
      float const y = static_cast<float>(t[c]) / 255.0f * alpha + truth.background[c] * (1.0f - alpha);
      float const d = image[at] - y, root = sqrtf(d * d + e * e);
      loss[pixel] += share * (root - e);
      squared[pixel] += share * d * d;
      gradient[at] = share * d / root;
    }
  }
};

int main(int argc, char** argv) try {
  if (argc < 3) return std::fprintf(stderr, "usage: own_loss DATASET MODEL.ply [ITERATIONS]\n"), 2;
  gart::dataset_options reading;
  reading.downscale = 4;
  gart::dataset const data = gart::load_dataset(argv[1], reading);
  gart::train_options options;
  options.iterations = argc > 3 ? std::atoi(argv[3]) : 2000;
  options.max_gaussians = 20'000;

  using exec = gart::openmp_exec;
  exec queue;
  gart::trainer<exec, gart::scene_traits<1>, gart::bvh_tracer<exec>, gart::pixel_method> training(
      queue, options, data, gart::initial_model(data, options, 1));

  gart::buffer<float, exec> loss(queue), squared(queue);
  auto const own_loss = [&](gart::loss_input<exec> const& in) {
    gart::index_t const pixels = static_cast<gart::index_t>(in.image.size() / 3);
    loss.resize(pixels), squared.resize(pixels);
    parallel_for(in.exec, "own loss", pixels, charbonnier{in.image, in.truth, in.gradient, loss, squared});
    reduce(in.exec, gart::span<float const>(loss), in.value.subspan(0, 1));
    reduce(in.exec, gart::span<float const>(squared), in.value.subspan(1, 1));
  };
  while (training.steps_done() < options.iterations) {
    gart::step_report const done = training.step(own_loss);
    if (done.step % 100 == 0) std::printf("%5d  loss %.4f  psnr %.2f dB\n", done.step, done.loss, done.psnr);
  }
  gart::write_splat_ply(argv[2], training.model());
  return 0;
} catch (std::exception const& e) {
  return std::fprintf(stderr, "own_loss: %s\n", e.what()), 1;
}
