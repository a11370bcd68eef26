#pragma once
// The forward pass: Gaussians into a frame (64 bytes each), the tracer's structure over them, rays through every pixel.
//
//   frame_records<E> records(exec);
//   bvh_tracer<E> tracer(exec);
//   records.prepare(exec, scene, view.position, options.alpha_min);
//   (for options.antialias with what an antialiased<E> shows of the scene, render/antialiased.hpp, here and below)
//   tracer.prepare(exec, scene, records.view(), view, options.alpha_min, options.near);
//   forward<3>(exec, tracer, scene, view, options, 3, targets, record_none{});
//
// Errors: invalid_argument for a camera or options that no ray can be traced by.

#include <gart/exec/stage.hpp>
#include <gart/render/packet_composite.hpp>
#include <gart/scene/parameters.hpp>
#include <gart/optim/random.hpp>
#include <gart/trace/ray_program.hpp>

#include <cstdlib>
#include <cstring>

namespace gart::inline GART_ISA {

inline float try_of(char const* name, float fallback) {
  char const* e = std::getenv("GART_TRY");
  if (!e) return fallback;
  std::size_t const n = std::strlen(name);
  for (char const* at = e; *at;) {
    if (!std::strncmp(at, name, n) && at[n] == '=') return static_cast<float>(std::atof(at + n + 1));
    at = std::strchr(at, ',');
    if (!at) break;
    ++at;
  }
  return fallback;
}

namespace render_kernels {

template <class Response>
struct prepare_records {
  gaussians_view<float const> scene;
  vec3d frame;
  float alpha_min;
  span<ray_gaussian> records;
  vec3 forward;
  float cull, order, drop;
  u32 step;
  GART_KERNEL void operator()(index_t i) const {
    auto const g = load_parameters(scene, i);
    ray_gaussian out = prepare<Response>(g, frame, alpha_min);
    vec3 const m = relative_mean(g.mean, frame);
    float const z = m.x * forward.x + m.y * forward.y + m.z * forward.z;
    out.unused[0] = order > 0 ? z : -1e30f;
    if (z < cull) out.cutoff = -1;
    if (drop > 0) {
      random_source const random{0x64726f70u, step, random_use::user};
      if (static_cast<float>(random.words(i).v[0] >> 8) * 0x1p-24f < drop) out.cutoff = -1;
    }
    records[i] = out;
  }
};

}  // namespace render_kernels

template <execution E>
class frame_records {
 public:
  explicit frame_records(E& exec) : records_(exec) {}
  // Response: the tracer's response_type.
  template <class Response = generalized_gaussian<>>
  void prepare(E& exec, gaussians_view<float const> scene, camera const& view, float alpha_min, int step = 0) {
    records_.resize(scene.count);
    static float const cull = try_of("cull", -1e30f), order = try_of("order", 0), drop = try_of("drop", 0);
    parallel_for(exec, "preprocess", scene.count,
                 render_kernels::prepare_records<Response>{scene, view.position, alpha_min, records_, view.rotation[2],
                                                           cull, order, step > 0 ? drop : 0.0f,
                                                           static_cast<u32>(step)});
  }
  span<ray_gaussian const> view() const { return records_; }

 private:
  buffer<ray_gaussian, E> records_;
};

// Gives a tracer those of the options that it has.
template <class Tracer>
void configure(Tracer& tracer, render_options const& options) {
  if constexpr (requires { tracer.rebuild_every; }) tracer.rebuild_every = options.rebuild_every;
}

// ShDegree is the degree the coefficients are stored with; bands above active_degree are not evaluated.
template <int ShDegree, execution E, class Tracer, class Record>
void forward(E& exec, Tracer& tracer, gaussians_view<float const> scene, camera const& view,
             render_options const& options, int active_degree, image_targets const& targets, Record const& record) {
  require_camera(view);
  require_options(options);
  pixel_order const order{view.width, view.height};
  composite<ShDegree, Record> const program{view, order, scene.sh, active_degree, options, targets, record};
  tracer.trace(exec, "forward", order.launch_size(), program);
}

}  // namespace gart::inline GART_ISA
