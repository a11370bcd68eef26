// The forward pass, traversal and shading, by tracer and by what it records for the backward pass.
#include "support/frame.hpp"

#include <gart/backward/backward.hpp>

namespace {

template <class By, class Method, gart::execution E>
void forward(benchmark::State& state, E& exec) {
  gart_bench::frame<E, By> frame(exec);
  frame.prepare();
  gart::backward_pass<typename gart_bench::frame<E, By>::traced_type, Method> pass(exec);
  if (!pass.prepare(frame.traced)) throw pass.out_of_memory_error();
  gart::buffer<float, E> color(exec, 3 * frame.pixels());
  gart_bench::measure(state, exec, [&] { pass.render(frame.traced, {color.data()}); });
  state.counters["hit_buffer_bytes"] = static_cast<double>(pass.hit_buffer_bytes());
}

}  // namespace

GART_BENCH("forward/bvh/record_none", forward<gart_bench::by_bvh, gart::pixel_method>)
GART_BENCH("forward/bvh/record_w", forward<gart_bench::by_bvh, gart::hybrid_method>)
GART_BENCH("forward/bvh/record_slots", forward<gart_bench::by_bvh, gart::primitive_method>)
GART_BENCH("forward/tiles/record_none", forward<gart_bench::by_tiles<8>, gart::pixel_method>)
GART_BENCH("forward/tiles/record_w", forward<gart_bench::by_tiles<8>, gart::hybrid_method>)
GART_BENCH("forward/tiles/record_slots", forward<gart_bench::by_tiles<8>, gart::primitive_method>)
GART_BENCH("forward/tiles/record_slots_depth",
           forward<gart_bench::by_tiles<8>, gart::with_depth<gart::primitive_method>>)
