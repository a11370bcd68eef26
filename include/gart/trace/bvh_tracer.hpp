#pragma once
/// \file
/// The traverser on gart's own BVH, on every policy. Rays of 8 x 4 pixels go through the tree as one beam
/// (trace/beam_walk.hpp). The traverser's prepare() fits the tree to the Gaussians of a frame. It builds anew, or
/// refits where their number has not changed and trace_options.rebuild_every says so.

#include <gart/camera/pixel_rays.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/scene/parameters.hpp>
#include <gart/trace/beam_walk.hpp>
#include <gart/trace/tracer.hpp>

namespace gart { inline namespace GART_ISA {

namespace trace_kernels {

template <class Response = generalized_gaussian<>>
struct bound_ellipsoids {
  gaussians_view<float const> scene;
  vec3d frame;
  float alpha_min;
  span<box> boxes;
  GART_KERNEL void operator()(index_t i) const {
    boxes[i] = ellipsoid_box<Response>(load_parameters(scene, i), frame, alpha_min);
  }
};

}  // namespace trace_kernels

/// Response: of the scene's Gaussians (math/response.hpp).
template <execution E, class Response = generalized_gaussian<>>
class bvh_tracer : public tracer_base {
 public:
  using response_type = Response;             ///< of the Gaussians
  static constexpr char const* name = "bvh";  ///< its name in requests

  /// Allocates nothing; `exec` must outlive it.
  explicit bvh_tracer(E& exec) : rays_(exec), boxes_(exec), tree_(exec), apart_(exec) {
    static_assert(tracer<bvh_tracer, E>);
  }

  /// View: a camera or a camera model.
  template <class View>
  void prepare(E& exec, gaussians_view<float const> scene, span<ray_gaussian const> gaussians, View const& view,
               trace_options const& options) {
    rays_.cast(exec, view);
    boxes_.resize(scene.count);
    parallel_for(exec, "bvh/boxes", scene.count,
                 trace_kernels::bound_ellipsoids<Response>{scene, view.position, options.alpha_min, boxes_});
    bool const rebuild = tree_.view().count != scene.count || ++age_ >= options.rebuild_every;
    if (rebuild) {
      tree_.build(exec, boxes_);
      age_ = 0;
    } else {
      tree_.refit(exec, boxes_);
    }
    scene_ = {gaussians.data(), scene.count, options.near};
  }

  /// Of the view that it was prepared for.
  pixel_rays rays() const { return rays_.view(); }
  /// The same, of a view without one centre.
  origin_rays rays_with_origins() const { return rays_.with_origins(); }

  /// Feeds `program` the hits of rays 0 to `rays`; `label` names the launch in profiles.
  template <ray_program P>
  void trace(E& exec, char const* label, index_t rays, P const& program) {
    trace_beams<Response>(exec, label, frame_index{tree_.view()}, scene_, rays, nullptr, apart_, program);
  }

  /// Over the ellipsoids' boxes, in the view's frame.
  bvh<E> const& tree() const { return tree_; }

 private:
  camera_rays<E> rays_;
  buffer<box, E> boxes_;
  bvh<E> tree_;
  buffer<u32, E> apart_;  // of the walk
  traced_scene scene_;
  int age_ = 0;
};

}}  // namespace gart::GART_ISA
