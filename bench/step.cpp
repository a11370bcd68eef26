// A whole training step on one view, by tracer and method. Rates of zero keep the scene as it is.
#include "support/frame.hpp"

#include <gart/train/trainer.hpp>

namespace {

template <class By, class Method, gart::execution E>
void step(benchmark::State& state, E& exec) {
  auto const& scene = gart_bench::the_scene();
  gart::dataset data;
  gart::dataset_view view;
  view.name = "noise", view.view = scene.view();
  view.image = gart::image8(view.view.width, view.view.height, 3);
  view.image.data = gart_bench::noise_bytes(view.image.data.size());
  data.train.push_back(std::move(view));
  gart::train_options options;
  options.iterations = 1, options.sh_every = 1;  // every coefficient from the first step
  options.densify = gart::densify_kind::none;
  options.rates = {0, 0, 0, 0, 0, 0, 0};
  using tracer = typename By::template tracer<E>;
  using traits = gart::scene_traits<gart_bench::sh_degree>;
  gart::trainer<E, traits, tracer, Method> trainer(exec, options, data, scene.model);
  gart_bench::measure(state, exec, [&] { trainer.step(); });
  state.counters["hit_buffer_bytes"] = static_cast<double>(trainer.hit_buffer_bytes());
  state.counters["peak_bytes"] = static_cast<double>(exec.memory.peak);
}

template <class By>
void add_steps(std::string const& tracer) {
  gart::gradient_methods::for_each([&]<class Method>(Method) {
    if constexpr (!Method::ordered)
      gart_bench::add(("step/" + tracer + "/" + Method::name).c_str(),
                      [](benchmark::State& state, auto& exec) { step<By, Method>(state, exec); });
  });
}

bool const added = (add_steps<gart_bench::by_bvh>("bvh"), add_steps<gart_bench::by_tiles<8>>("tiles"), true);

}  // namespace
