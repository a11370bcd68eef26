// The OptiX tracer on one view, against tile lists, and on rays without any order, against the tree. Beside the times:
// whether both show the same bits, and the milliseconds of OptiX's launches and of gart's kernel.
#include "support/frame.hpp"

#include <gart/rays/ray_tracer.hpp>
#include <gart/trace/optix_tracer.hpp>

namespace {

struct by_optix {
  template <gart::execution E>
  using tracer = gart::optix_tracer<E>;
};

template <class F>
void stages(benchmark::State& state, gart::cuda_exec& exec, F const& f) {
  exec.profile.clear(), exec.profile.enable(true);
  f();
  exec.synchronize();
  exec.profile.enable(false);
  for (auto const& [label, stage] : exec.profile.stages())
    if (label.rfind("optix/", 0) == 0) state.counters[label.substr(6)] = stage.milliseconds;
}

// The frame of a view with its tree, which is built anew or refitted.
template <class By, bool Refit = false>
void prepare(benchmark::State& state, gart::cuda_exec& exec) {
  gart_bench::frame<gart::cuda_exec, By> frame(exec);
  if (Refit) frame.options.rebuild_every = 1 << 30;
  gart_bench::measure(state, exec, [&] { frame.prepare(); });
  stages(state, exec, [&] { frame.prepare(); });
}

void view(benchmark::State& state, gart::cuda_exec& exec) {
  gart_bench::frame<gart::cuda_exec, gart_bench::by_tiles<>> tiles(exec);
  gart_bench::frame<gart::cuda_exec, by_optix> optix(exec);
  gart::buffer<float, gart::cuda_exec> expected(exec, 3 * tiles.pixels()), color(exec, 3 * tiles.pixels());
  tiles.prepare(), optix.prepare();
  tiles.traced.render({expected.data()});
  auto const render = [&] { optix.traced.render({color.data()}); };
  gart_bench::measure(state, exec, render);
  state.counters["same"] = expected.to_host() == color.to_host();
  stages(state, exec, render);
}

void incoherent(benchmark::State& state, gart::cuda_exec& exec) {
  constexpr std::size_t n = 1'000'000;
  gart_bench::frame<gart::cuda_exec, by_optix> optix(exec);
  std::vector<float> const o = gart_bench::noise(3 * n + 1, 0.3f);
  gart::buffer<float, gart::cuda_exec> origins(exec, std::vector<float>(o.begin() + 1, o.end())),
      directions(exec, gart_bench::noise(3 * n, 1)), expected(exec, 3 * n), color(exec, 3 * n);
  gart::ray_batch const rays{optix.view.position, origins, directions, {}};
  gart::ray_tracer<gart::cuda_exec> tree(exec);
  tree.set_scene(optix.scene(), gart_bench::sh_degree);
  tree.trace(rays, optix.options, {.color = expected.data()});
  optix.prepare();
  gart::gaussians_view<float const> const scene = optix.scene();
  gart::batch_composite<> const program{{},
                                        gart::batch_rays(rays),
                                        {scene.sh, scene.sh_degree, gart_bench::sh_degree},
                                        optix.options,
                                        {.color = color.data()},
                                        {}};
  auto const trace = [&] { optix.traced.trace("rays", static_cast<gart::index_t>(n), program); };
  gart_bench::measure(state, exec, trace);
  state.counters["same"] = expected.to_host() == color.to_host();
  stages(state, exec, trace);
}

}  // namespace

GART_BENCH("optix/prepare", prepare<by_optix>)
GART_BENCH("optix/prepare/refit", prepare<by_optix, true>)
GART_BENCH("optix/prepare/tree", prepare<gart_bench::by_bvh>)
GART_BENCH("optix/view", view)
GART_BENCH("optix/incoherent", incoherent)
