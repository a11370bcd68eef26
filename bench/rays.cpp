// Batches of rays: a lidar of 64 x 1024 at the view's place, and rays without any order from places near it; what they
// see, their hits, and their gradients in each form.
#include "support/frame.hpp"

#include <gart/rays/lidar.hpp>
#include <gart/rays/ray_tracer.hpp>

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

}  // namespace

GART_BENCH("rays/lidar/trace", trace<lidar>)
GART_BENCH("rays/lidar/list", list<lidar>)
GART_BENCH("rays/lidar/backward/primitive", backward<lidar, gradient_form::primitive>)
GART_BENCH("rays/lidar/backward/scatter", backward<lidar, gradient_form::scatter>)
GART_BENCH("rays/lidar/both/primitive", both<lidar, gradient_form::primitive>)
GART_BENCH("rays/lidar/both/scatter", both<lidar, gradient_form::scatter>)
GART_BENCH("rays/incoherent/trace", trace<incoherent>)
GART_BENCH("rays/incoherent/list", list<incoherent>)
GART_BENCH("rays/incoherent/backward/primitive", backward<incoherent, gradient_form::primitive>)
GART_BENCH("rays/incoherent/backward/scatter", backward<incoherent, gradient_form::scatter>)
