// The backward pass by strategy and tile size, and what it asks of the step before it: footprints and the LT buffer.
#include "support/frame.hpp"

#include <gart/backward/backward.hpp>

namespace {

template <gart::execution E, class By, class Strategy, int TileSize>
struct backward_frame {
  gart_bench::frame<E, By> frame;
  gart::backward<E, Strategy, TileSize> pass;
  gart::gaussians<E> gradients;
  gart::buffer<float, E> color, color_gradient;

  explicit backward_frame(E& exec)
      : frame(exec),
        pass(exec),
        gradients(exec, frame.gaussians.size(), gart_bench::sh_degree),
        color(exec, 3 * frame.pixels()),
        color_gradient(exec, gart_bench::noise(3 * frame.pixels(), 1e-6f)) {
    frame.prepare(exec);
    prepare(exec);
    gart::forward<gart_bench::sh_degree>(exec, frame.tracer, frame.scene(), frame.view, frame.options,
                                         gart_bench::sh_degree, pass.targets(color.data()), pass.record());
  }
  void prepare(E& exec) {
    if (!pass.prepare(exec, frame.tracer, frame.scene(), frame.view, frame.options.alpha_min, frame.options.near))
      throw pass.no_room();
  }
  void run(E& exec) {
    pass.template run<gart_bench::sh_degree>(exec, frame.tracer, frame.scene(), frame.records.view(), frame.view,
                                             frame.options, gart_bench::sh_degree, color, color_gradient, gradients);
  }
};

template <class By, class Strategy, int TileSize, gart::execution E>
void backward(benchmark::State& state, E& exec) {
  backward_frame<E, By, Strategy, TileSize> f(exec);
  gart_bench::measure(state, exec, [&] { f.run(exec); });
  state.counters["lt_bytes"] = static_cast<double>(f.pass.lt_bytes());
}

// The tile lists and the clear of the LT buffer, and footprints where no tracer lends them.
template <class By, class Strategy, int TileSize, gart::execution E>
void prepare(benchmark::State& state, E& exec) {
  backward_frame<E, By, Strategy, TileSize> f(exec);
  gart_bench::measure(state, exec, [&] { f.prepare(exec); });
  state.counters["lt_bytes"] = static_cast<double>(f.pass.lt_bytes());
}

using gart_bench::by_bvh;
using gart_bench::by_tiles;

}  // namespace

GART_BENCH("backward/bvh/pixel", backward<by_bvh, gart::pixel_strategy, 8>)
GART_BENCH("backward/bvh/hybrid/8", backward<by_bvh, gart::hybrid_strategy, 8>)
GART_BENCH("backward/bvh/primitive/8", backward<by_bvh, gart::primitive_strategy, 8>)
GART_BENCH("backward/tiles/pixel", backward<by_tiles<8>, gart::pixel_strategy, 8>)
GART_BENCH("backward/tiles/hybrid/8", backward<by_tiles<8>, gart::hybrid_strategy, 8>)
GART_BENCH("backward/tiles/primitive/4", backward<by_tiles<4>, gart::primitive_strategy, 4>)
GART_BENCH("backward/tiles/primitive/8", backward<by_tiles<8>, gart::primitive_strategy, 8>)
GART_BENCH("backward/tiles/primitive/16", backward<by_tiles<16>, gart::primitive_strategy, 16>)
#if defined(GART_BENCH_CUDA)
GART_BENCH("backward/tiles/lane/8", backward<by_tiles<8>, gart::lane_strategy, 8>)
#endif
GART_BENCH("backward/tiles/deterministic/8", backward<by_tiles<8>, gart::deterministic_strategy, 8>)
GART_BENCH("prepare/bvh/primitive/8", prepare<by_bvh, gart::primitive_strategy, 8>)
GART_BENCH("prepare/tiles/primitive/8", prepare<by_tiles<8>, gart::primitive_strategy, 8>)
