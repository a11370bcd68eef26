// The backward pass by method and tile size. Also what it asks of the step before it: footprints and the hit buffer.
#include "support/frame.hpp"

#include <gart/backward/backward.hpp>

namespace {

template <gart::execution E, class By, class Method>
struct backward_frame {
  gart_bench::frame<E, By> frame;
  gart::backward_pass<typename gart_bench::frame<E, By>::traced_type, Method> pass;
  gart::gaussians<E> gradients;
  gart::buffer<float, E> color, color_gradient, depth, depth_gradient;

  explicit backward_frame(E& exec)
      : frame(exec),
        pass(exec),
        gradients(exec, frame.gaussians.size(), gart_bench::sh_degree),
        color(exec, 3 * frame.pixels()),
        color_gradient(exec, gart_bench::noise(3 * frame.pixels(), 1e-6f)),
        depth(exec, of_depth ? frame.pixels() : 0),
        depth_gradient(exec, gart_bench::noise(of_depth ? frame.pixels() : 0, 1e-6f)) {
    frame.prepare();
    prepare();
    pass.render(frame.traced, {.color = color.data(), .depth = of_depth ? depth.data() : nullptr});
  }
  static constexpr bool of_depth = gart::has_depth<Method>;
  void prepare() {
    if (!pass.prepare(frame.traced)) throw pass.out_of_memory_error();
  }
};

template <class By, class Method, gart::execution E>
void backward(benchmark::State& state, E& exec) {
  backward_frame<E, By, Method> f(exec);
  gart_bench::measure(state, exec, [&] {
    gart::differentiate(f.frame.traced, f.pass, {f.color_gradient, f.depth_gradient}, f.gradients);
  });
  state.counters["hit_buffer_bytes"] = static_cast<double>(f.pass.hit_buffer_bytes());
}

// The tile lists and the clear of the hit buffer, and footprints where no tracer lends them.
template <class By, class Method, gart::execution E>
void prepare(benchmark::State& state, E& exec) {
  backward_frame<E, By, Method> f(exec);
  gart_bench::measure(state, exec, [&] { f.prepare(); });
  state.counters["hit_buffer_bytes"] = static_cast<double>(f.pass.hit_buffer_bytes());
}

template <class By, class Method>
void add(std::string const& name) {
  gart_bench::add(name.c_str(), [](benchmark::State& state, auto& exec) { backward<By, Method>(state, exec); });
}

using gart_bench::by_bvh;
using gart_bench::by_tiles;

// Every method on tile lists; on the BVH those without ordered sums. `/8`: the tiles that footprints are cut into.
bool const added = [] {
  gart::gradient_methods::for_each([]<class Method>(Method) {
    std::string const name = Method::name, cut = Method::gather::any ? "/8" : "";
    add<by_tiles<8>, Method>("backward/tiles/" + name + cut);
    if constexpr (!Method::ordered) add<by_bvh, Method>("backward/bvh/" + name + cut);
  });
  return true;
}();

}  // namespace

GART_BENCH("backward/tiles/primitive_depth/8", backward<by_tiles<8>, gart::with_depth<gart::primitive_method>>)
GART_BENCH("prepare/bvh/primitive/8", prepare<by_bvh, gart::primitive_method>)
GART_BENCH("prepare/tiles/primitive/8", prepare<by_tiles<8>, gart::primitive_method>)
