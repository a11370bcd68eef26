// L1 + SSIM of the image and its gradient.
#include "support/frame.hpp"

#include <gart/loss/image_loss.hpp>

namespace {

template <gart::execution E>
void loss(benchmark::State& state, E& exec) {
  gart::camera const& view = gart_bench::the_scene().view();
  std::size_t const values = std::size_t{3} * view.width * view.height;
  gart::buffer<float, E> const image(exec, gart_bench::noise(values, 0.3f));
  gart::buffer<gart::u8, E> const truth(exec, gart_bench::noise_bytes(values));
  gart::buffer<float, E> gradient(exec, values), value(exec, 2);
  gart::image_loss<E> loss(exec);
  gart_bench::measure(state, exec, [&] {
    loss.evaluate(image, gart::truth_view{truth.data()}, view.width, view.height, 0.2f, gradient, value);
  });
}

}  // namespace

GART_BENCH("loss", loss)
