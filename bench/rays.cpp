// Rays of a view, by tile lists, by the tree and as a batch. Also a lidar of 64 x 1024 at the view's place, and rays
// without any order from places near it. What they see, their hits, and their gradients in each form. `alone` is the
// walk that takes rays one by one, `groups` the one by eight lanes a ray. `choice` has beams of other widths than the
// library's. Beside the times: whether the batch shows the same bits as what it is compared with.
#include "support/frame.hpp"

#include <gart/rays/lidar.hpp>
#include <gart/rays/ray_tracer.hpp>

#include <map>
#include <string>

namespace {

using gart::gradient_form;

gart::ray_list lidar() {
  std::vector<float> elevations;
  for (int beam = 0; beam < 64; ++beam) elevations.push_back(0.3f - 0.6f * static_cast<float>(beam) / 63);
  gart::camera const& view = gart_bench::the_scene().view();
  // Forward is the camera's z, left its -x, up its -y.
  gart::sensor_pose const pose{gart::mat3(view.rotation[2], -view.rotation[0], -view.rotation[1]), view.position};
  return gart::rays_of(gart::spinning_lidar(elevations, 1024), pose);
}

gart::ray_list incoherent() {
  constexpr std::size_t rays = gart_bench::on_device ? 1'000'000 : 20'000;
  gart::camera const& view = gart_bench::the_scene().view();
  gart::ray_list out;
  out.frame = view.position;
  std::vector<float> const d = gart_bench::noise(3 * rays, 1), o = gart_bench::noise(3 * rays + 1, 0.3f);
  out.directions = d, out.origins.assign(o.begin() + 1, o.end());
  return out;
}

// One index a pixel.
struct copy_directions {
  gart::pixel_rays rays;
  int width;
  float* directions;
  GART_KERNEL void operator()(gart::index_t i) const {
    gart::vec3 const d =
        gart::pixel_ray(rays, gart::pixel{static_cast<int>(i) % width, static_cast<int>(i) / width}).direction;
    for (gart::index_t k = 0; k < 3; ++k) directions[3 * i + k] = d[static_cast<int>(k)];
  }
};

gart::ray_list view() {
  gart::serial_exec exec;
  gart::camera const& camera = gart_bench::the_scene().view();
  gart::camera_rays<gart::serial_exec> rays(exec);
  rays.cast(exec, camera);
  gart::ray_list out;
  out.frame = camera.position;
  out.directions.resize(std::size_t{3} * camera.width * camera.height);
  gart::index_t const pixels = static_cast<gart::index_t>(out.directions.size() / 3);
  copy_directions const copy{rays.view(), camera.width, out.directions.data()};
  for (gart::index_t i = 0; i < pixels; ++i) copy(i);
  return out;
}

template <gart::execution E>
struct batch {
  gart::gaussians<E> scene, gradients;
  gart::buffer<float, E> origins, directions, color, by_color;
  gart::ray_batch rays;
  gart::ray_tracer<E> tracer;
  gart::render_options options;

  batch(E& exec, gart::ray_list const& list)
      : scene(exec, gart_bench::the_scene().model),
        gradients(exec, scene.size(), gart_bench::sh_degree),
        origins(exec, list.origins),
        directions(exec, list.directions),
        color(exec, list.directions.size()),
        by_color(exec, gart_bench::noise(list.directions.size(), 1e-6f)),
        rays{list.frame, origins, directions, {}},
        tracer(exec) {
    set_scene();
  }
  void set_scene() { tracer.set_scene(std::as_const(scene).view(), gart_bench::sh_degree); }
  void trace() { tracer.trace(rays, options, {.color = color.data()}); }
  auto forward(gradient_form form) { return tracer.forward(rays, options, {}, form); }
  void backward(gart::batch_context<E>& context) { tracer.backward(context, {by_color}, gradients.view()); }
};

template <gart::ray_list (*Rays)(), gart::execution E>
void trace(benchmark::State& state, E& exec) {
  batch<E> b(exec, Rays());
  gart_bench::measure(state, exec, [&] { b.trace(); });
  state.counters["rays"] = b.rays.count();
}

// The same rays by the walks themselves. All go one by one (widest: 0), or in beams of a width and a number of
// candidates at most. `grouped`: those that are no beams go by eight lanes each.
template <gart::ray_list (*Rays)(), gart::execution E>
void walks(benchmark::State& state, E& exec, float widest, int most, bool ordered = true, bool grouped = false) {
  using response = gart::generalized_gaussian<>;
  using program_type = gart::batch_composite<>;
  batch<E> b(exec, Rays());
  b.trace();
  gart::gaussians_view<float const> const scene = std::as_const(b.scene).view();
  gart::index_t const rays = b.rays.count(), beams = (rays + gart::beam_lanes - 1) / gart::beam_lanes;
  gart::buffer<gart::ray_gaussian, E> records(exec, scene.count);
  gart::parallel_for(
      exec, "records", scene.count,
      gart::render_kernels::prepare_gaussians<response>{scene, b.rays.frame, b.options.alpha_min, records.view()});
  gart::buffer<float, E> color(exec, b.color.size());
  gart::buffer<gart::u32, E> apart(exec, beams);
  program_type const program{{},        gart::batch_rays(b.rays), {scene.sh, scene.sh_degree, gart_bench::sh_degree},
                             b.options, {color.data()},           {}};
  gart::traced_scene const traced{records.data(), scene.count, b.options.near};
  gart::world_view const index = b.tracer.index().seen_from(b.rays.frame);
  gart::ray_order<E> order(exec);
  order.make(exec, b.rays, index.tree, index.shift);
  bool const beamed = widest > 0;
  gart::u32 const* const neighbours = ordered ? order.of(rays) : nullptr;
  gart::trace_kernels::walk_beams<response, gart::world_view, program_type> const together{
      index, traced, program, rays, neighbours, apart.data(), widest, most};
  gart_bench::measure(state, exec, [&] {
    if (beamed)
      gart::parallel_for(exec, "beams", gart::tile_range{beams, static_cast<gart::index_t>(gart::beam_lanes)},
                         together);
    gart::u32 const* const others = beamed ? apart.data() : nullptr;
    if (grouped)
      gart::trace_kernels::trace_groups<response>(exec, "groups", index, traced, rays, neighbours, others, program);
    else
      gart::trace_kernels::trace_alone<response>(exec, "alone", index, traced, rays, neighbours, others, program);
  });
  state.counters["rays"] = rays;
  state.counters["same"] = color.to_host() == b.color.to_host();
  if (!beamed) return;
  double left = 0;
  for (gart::u32 const one : apart.to_host()) left += one;
  state.counters["apart"] = left / beams;
}

template <class By, gart::execution E>
void image(benchmark::State& state, E& exec) {
  gart_bench::frame<E, By> frame(exec);
  frame.prepare();
  gart::buffer<float, E> color(exec, 3 * frame.pixels());
  gart_bench::measure(state, exec, [&] { frame.traced.render({color.data()}); });
  batch<E> b(exec, view());
  b.trace();
  state.counters["rays"] = b.rays.count();
  state.counters["same"] = color.to_host() == b.color.to_host();
}

template <gart::ray_list (*Rays)(), gart::execution E>
void list(benchmark::State& state, E& exec) {
  batch<E> b(exec, Rays());
  gart_bench::measure(state, exec, [&] { b.tracer.list(b.rays, b.options); });
  state.counters["hits_per_ray"] =
      static_cast<double>(b.tracer.list(b.rays, b.options).ids.size()) / static_cast<double>(b.rays.count());
}

template <gart::ray_list (*Rays)(), gradient_form Form, gart::execution E>
void backward(benchmark::State& state, E& exec) {
  batch<E> b(exec, Rays());
  auto context = b.forward(Form);
  gart_bench::measure(
      state, exec, [&] { context = b.forward(Form); }, [&] { b.backward(context); });
}

template <gart::ray_list (*Rays)(), gradient_form Form, gart::execution E>
void both(benchmark::State& state, E& exec) {
  batch<E> b(exec, Rays());
  gart_bench::measure(state, exec, [&] {
    auto context = b.forward(Form);
    b.backward(context);
  });
}

template <gart::ray_list (*Rays)(), gradient_form Form, gart::execution E>
void forward(benchmark::State& state, E& exec) {
  batch<E> b(exec, Rays());
  gart_bench::measure(state, exec, [&] { b.forward(Form); });
}

// Both passes; every stage of them is a counter, in milliseconds. The clocks between stages cost a little themselves.
template <gart::ray_list (*Rays)(), gradient_form Form, gart::execution E>
void stages(benchmark::State& state, E& exec) {
  batch<E> b(exec, Rays());
  auto const both = [&] {
    gart::stage_scope<E> scope(exec, "all");
    auto context = b.forward(Form);
    b.backward(context);
  };
  both();
  std::map<std::string, double> sums;
  for (auto _ : state) {
    exec.profile.clear(), exec.profile.enable(true);
    both();
    exec.synchronize();
    exec.profile.enable(false);
    for (auto const& [label, stage] : exec.profile.stages()) sums[label] += stage.milliseconds;
    state.SetIterationTime(1e-3 * exec.profile.stages().at("all").milliseconds);
  }
  for (auto const& [label, sum] : sums)
    state.counters[label] = benchmark::Counter(sum, benchmark::Counter::kAvgIterations);
}

}  // namespace

GART_BENCH("rays/view/tiles", image<gart_bench::by_tiles<8>>)
GART_BENCH("rays/view/tree", image<gart_bench::by_bvh>)
GART_BENCH("rays/view/trace", trace<view>)
GART_BENCH("rays/view/alone", [](auto& state, auto& exec) { walks<view>(state, exec, 0, 0); })
GART_BENCH("rays/view/groups", [](auto& state, auto& exec) { walks<view>(state, exec, 0, 0, true, true); })
GART_BENCH("rays/lidar/trace", trace<lidar>)
GART_BENCH("rays/lidar/alone", [](auto& state, auto& exec) { walks<lidar>(state, exec, 0, 0); })
GART_BENCH("rays/lidar/groups", [](auto& state, auto& exec) { walks<lidar>(state, exec, 0, 0, true, true); })
GART_BENCH("rays/lidar/list", list<lidar>)
GART_BENCH("rays/lidar/forward/primitive", forward<lidar, gradient_form::primitive>)
GART_BENCH("rays/lidar/backward/primitive", backward<lidar, gradient_form::primitive>)
GART_BENCH("rays/lidar/backward/scatter", backward<lidar, gradient_form::scatter>)
GART_BENCH("rays/lidar/both/primitive", both<lidar, gradient_form::primitive>)
GART_BENCH("rays/lidar/both/scatter", both<lidar, gradient_form::scatter>)
GART_BENCH("rays/lidar/stages/primitive", stages<lidar, gradient_form::primitive>)
GART_BENCH("rays/incoherent/trace", trace<incoherent>)
GART_BENCH("rays/incoherent/alone", [](auto& state, auto& exec) { walks<incoherent>(state, exec, 0, 0); })
GART_BENCH("rays/incoherent/groups", [](auto& state, auto& exec) { walks<incoherent>(state, exec, 0, 0, true, true); })
GART_BENCH("rays/incoherent/list", list<incoherent>)
GART_BENCH("rays/incoherent/backward/primitive", backward<incoherent, gradient_form::primitive>)
GART_BENCH("rays/incoherent/backward/scatter", backward<incoherent, gradient_form::scatter>)
// What the library chooses, against other widths and numbers.
GART_BENCH("rays/choice/view/all", [](auto& state, auto& exec) { walks<view>(state, exec, 100, 1 << 30); })
GART_BENCH("rays/choice/lidar/0.03",
           [](auto& state, auto& exec) { walks<lidar>(state, exec, 0.03f, 2048, true, true); })
GART_BENCH("rays/choice/lidar/0.06",
           [](auto& state, auto& exec) { walks<lidar>(state, exec, 0.06f, 2048, true, true); })
GART_BENCH("rays/choice/lidar/0.25", [](auto& state, auto& exec) { walks<lidar>(state, exec, 0.25f, 2048); })
GART_BENCH("rays/choice/lidar/unordered", [](auto& state, auto& exec) { walks<lidar>(state, exec, 0, 0, false, true); })
GART_BENCH("rays/choice/incoherent/unordered",
           [](auto& state, auto& exec) { walks<incoherent>(state, exec, 0, 0, false); })
GART_BENCH("rays/choice/incoherent/narrow", [](auto& state, auto& exec) { walks<incoherent>(state, exec, 0.1f, 1024); })
