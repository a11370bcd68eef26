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
#include <gart/trace/ray_program.hpp>

namespace gart::inline GART_ISA {

namespace render_kernels {

template <class Response>
struct prepare_records {
  gaussians_view<float const> scene;
  vec3d frame;
  float alpha_min;
  span<ray_gaussian> records;
  GART_KERNEL void operator()(index_t i) const {
    records[i] = prepare<Response>(load_parameters(scene, i), frame, alpha_min);
  }
};

}  // namespace render_kernels

template <execution E>
class frame_records {
 public:
  explicit frame_records(E& exec) : records_(exec) {}
  // Response: the tracer's response_type.
  template <class Response = generalized_gaussian<>>
  void prepare(E& exec, gaussians_view<float const> scene, vec3d frame, float alpha_min) {
    records_.resize(scene.count);
    parallel_for(exec, "preprocess", scene.count,
                 render_kernels::prepare_records<Response>{scene, frame, alpha_min, records_});
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
// View: what the tracer was prepared for.
template <int ShDegree, execution E, class Tracer, class Record, class View>
void forward(E& exec, Tracer& tracer, gaussians_view<float const> scene, View const& view,
             render_options const& options, int active_degree, image_targets const& targets, Record const& record) {
  require_camera(view);
  require_options(options);
  pixel_order const order{view.width, view.height};
  composite<ShDegree, Record> const program{tracer.rays(), order, scene.sh, active_degree, options, targets, record};
  tracer.trace(exec, "forward", order.launch_size(), program);
}

}  // namespace gart::inline GART_ISA
