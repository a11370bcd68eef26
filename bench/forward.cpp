// The forward pass, traversal and shading, by tracer and by what it records for the backward pass.
#include "support/frame.hpp"

#include <gart/backward/backward.hpp>

namespace {

template <class By, class Strategy, gart::execution E>
void forward(benchmark::State& state, E& exec) {
  gart_bench::frame<E, By> frame(exec);
  frame.prepare(exec);
  gart::backward<E, Strategy> pass(exec);
  if (!pass.prepare(exec, frame.tracer, frame.scene(), frame.view, frame.options.alpha_min, frame.options.near))
    throw pass.no_room();
  gart::buffer<float, E> color(exec, 3 * frame.pixels());
  gart_bench::measure(state, exec, [&] {
    gart::forward<gart_bench::sh_degree>(exec, frame.tracer, frame.scene(), frame.view, frame.options,
                                         gart_bench::sh_degree, {color.data()}, pass.record());
  });
  state.counters["lt_bytes"] = static_cast<double>(pass.lt_bytes());
}

}  // namespace

GART_BENCH("forward/bvh/record_none", forward<gart_bench::by_bvh, gart::pixel_strategy>)
GART_BENCH("forward/bvh/record_w", forward<gart_bench::by_bvh, gart::hybrid_strategy>)
GART_BENCH("forward/bvh/record_lt", forward<gart_bench::by_bvh, gart::primitive_strategy>)
GART_BENCH("forward/tiles/record_none", forward<gart_bench::by_tiles<8>, gart::pixel_strategy>)
GART_BENCH("forward/tiles/record_w", forward<gart_bench::by_tiles<8>, gart::hybrid_strategy>)
GART_BENCH("forward/tiles/record_lt", forward<gart_bench::by_tiles<8>, gart::primitive_strategy>)
