// A sample of paths through all the view's pixels: of Gaussians alone, and with surfaces, by the number of bounces. The
// surfaces are a mirror ball on a rough floor, under a sun before the camera. What shadows cost, once a Gaussian and at
// each hit. Frames as a viewer that moves asks for them, of the run's scene where it has one. Their wall time goes from
// a camera to bytes on the host. The times of their stages are beside it.
#include "support/frame.hpp"

#include <gart/light/path_tracer.hpp>
#include <gart/render/bytes.hpp>

#include <chrono>

namespace {

namespace light = gart::light;
using gart::vec3;

// In the view's axes: across, down, ahead.
vec3 placed(vec3 const& at) {
  gart::camera const& view = gart_bench::the_scene().view();
  return vec3(view.position) + view.rotation * at;
}

light::scene ball_on_floor() {
  light::scene s;
  light::mesh floor, ball;
  for (float const x : {-2.0f, 2.0f})
    for (float const z : {0.5f, 4.5f}) floor.positions.push_back(placed({x, 0.8f, z}));
  floor.triangles = {0, 1, 2, 2, 1, 3};
  floor.triangle_material = {0, 0};
  constexpr int rings = 64;
  for (int i = 0; i <= rings; ++i)
    for (int j = 0; j <= 2 * rings; ++j) {
      float const theta = 3.14159265f * static_cast<float>(i) / rings,
                  phi = 3.14159265f * static_cast<float>(j % (2 * rings)) / rings;
      vec3 const n(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
      ball.positions.push_back(placed(vec3(0, 0.3f, 2.5f) + 0.5f * n));
      ball.normals.push_back(gart_bench::the_scene().view().rotation * n);
    }
  for (gart::u32 i = 0; i < rings; ++i)
    for (gart::u32 j = 0; j < 2 * rings; ++j) {
      gart::u32 const a = i * (2 * rings + 1) + j, b = a + 2 * rings + 1;
      for (gart::u32 const c : {a, a + 1, b + 1, a, b + 1, b}) ball.triangles.push_back(c);
    }
  ball.triangle_material.assign(ball.triangles.size() / 3, 1);
  s.materials.resize(2);
  s.materials[1].kind = light::material_kind::mirror, s.materials[1].base_color = vec3(0.9f);
  light::light sun;
  sun.kind = light::light_kind::directional, sun.angle = 0.005f, sun.color = vec3(2.0f);
  sun.direction = gart_bench::the_scene().view().rotation * vec3(0.3f, 1, 0.2f);
  s.lights = {sun};
  s.around.color = vec3(0.5f);
  s.meshes = {floor, ball};
  return s;
}

template <gart::execution E>
struct paths {
  gart::gaussians<E> model;
  gart::path_tracer<E> tracer;
  light::path_options options;

  paths(E& exec, light::scene const& scene, int bounces, light::shadow_kind shadows)
      : model(exec, gart_bench::the_scene().model), tracer(exec) {
    options.bounces = bounces, options.shadows = shadows;
    tracer.set_model(std::as_const(model).view(), gart_bench::sh_degree);
    tracer.set_scene(scene);
    begin();
  }
  void begin() { tracer.begin(gart_bench::the_scene().view(), {}, options); }
};

template <gart::execution E>
void gaussians(benchmark::State& state, E& exec) {
  paths<E> p(exec, {}, 0, light::shadow_kind::none);
  gart_bench::measure(state, exec, [&] { p.tracer.add(1); });
}

template <int Bounces, light::shadow_kind Shadows, gart::execution E>
void sample(benchmark::State& state, E& exec) {
  paths<E> p(exec, ball_on_floor(), Bounces, Shadows);
  gart_bench::measure(state, exec, [&] { p.tracer.add(1); });
}

template <int Bounces, gart::first_hits First, gart::execution E>
void frame(benchmark::State& state, E& exec) {
  auto const& among = gart_bench::the_scene().among;
  light::scene const scene = among ? among->scene : ball_on_floor();
  gart::camera view = gart_bench::the_scene().view();
  gart::gaussians<E> const model(exec, gart_bench::the_scene().model);
  gart::path_tracer<E> tracer(exec);
  tracer.set_model(model.view(), model.sh_degree());
  tracer.set_scene(scene);
  tracer.find_first(First);
  light::path_options options = among ? among->paths : light::path_options{};
  options.bounces = Bounces;
  std::size_t const values =
      std::size_t{3} * static_cast<std::size_t>(view.width) * static_cast<std::size_t>(view.height);
  gart::buffer<float, E> shown(exec, values);
  gart::buffer<gart::u8, E> bytes(exec, values);
  auto const draw = [&] {
    view.position.x += 1e-3;
    tracer.begin(view, {}, options);
    tracer.add(1);
    tracer.show(options.exposure, options.tone, shown.data());
    gart::color_to_bytes(exec, shown.data(), tracer.pixels(), bytes.data(), 3);
    benchmark::DoNotOptimize(bytes.to_host().data());
  };
  draw(), draw();
  using clock = std::chrono::steady_clock;
  for (auto _ : state) {
    auto const start = clock::now();
    draw();
    state.SetIterationTime(std::chrono::duration<double>(clock::now() - start).count());
  }
  constexpr int timed = 5;
  exec.profile.clear(), exec.profile.enable(true);
  for (int i = 0; i < timed; ++i) draw();
  exec.synchronize();
  for (auto const& [label, time] : exec.profile.stages()) state.counters[label + "_ms"] = time.milliseconds / timed;
  exec.profile.enable(false), exec.profile.clear();
}

template <gart::execution E>
void shade(benchmark::State& state, E& exec) {
  paths<E> p(exec, ball_on_floor(), 0, light::shadow_kind::per_gaussian);
  gart_bench::measure(state, exec, [&] {
    ++p.options.seed;  // no other is shaded anew
    p.begin();
  });
}

}  // namespace

GART_BENCH("light/gaussians", gaussians)
GART_BENCH("light/bounces_0", sample<0, gart::light::shadow_kind::per_gaussian>)
GART_BENCH("light/bounces_1", sample<1, gart::light::shadow_kind::per_gaussian>)
GART_BENCH("light/bounces_2", sample<2, gart::light::shadow_kind::per_gaussian>)
GART_BENCH("light/bounces_3", sample<3, gart::light::shadow_kind::per_gaussian>)
GART_BENCH("light/bounces_4", sample<4, gart::light::shadow_kind::per_gaussian>)
GART_BENCH("light/bounces_5", sample<5, gart::light::shadow_kind::per_gaussian>)
GART_BENCH("light/bounces_6", sample<6, gart::light::shadow_kind::per_gaussian>)
GART_BENCH("light/frame/bounces_0", frame<0, gart::first_hits::tiles>)
GART_BENCH("light/frame/bounces_1", frame<1, gart::first_hits::tiles>)
GART_BENCH("light/frame/bounces_2", frame<2, gart::first_hits::tiles>)
GART_BENCH("light/frame/bounces_4", frame<4, gart::first_hits::tiles>)
GART_BENCH("light/frame/bounces_6", frame<6, gart::first_hits::tiles>)
GART_BENCH("light/frame/bounces_1/tree", frame<1, gart::first_hits::tree>)
GART_BENCH("light/bounces_1/per_hit", sample<1, gart::light::shadow_kind::per_hit>)
GART_BENCH("light/shade_gaussians", shade)
