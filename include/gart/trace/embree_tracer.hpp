#pragma once
/// \file
/// The traverser on Embree, for the host policies: user geometry over the ellipsoids' boxes. A ray takes a window of
/// the nearest hits and resumes until it ends. Embree proposes, math/ray_gaussian.hpp decides: the hits are those of
/// the BVH tracer, bit for bit. Link gart::embree; this header itself needs no Embree.

#include <gart/bvh/box.hpp>
#include <gart/scene/parameters.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/k_buffer_visitor.hpp>
#include <gart/trace/tracer.hpp>

#include <memory>

namespace gart {

/// An Embree scene over boxes. For every box the ray may cross between near and *far, intersect calls `leaf`. Boxes
/// come in no particular order; `leaf` may shorten *far.
class embree_scene {
 public:
  /// An empty scene, on a device of Embree's own.
  embree_scene();
  ~embree_scene();
  /// The other is left empty.
  embree_scene(embree_scene&&) noexcept;
  /// The other is left empty.
  embree_scene& operator=(embree_scene&&) noexcept;

  /// The boxes are read until the next build.
  void build(span<box const> boxes);

  /// Given the visitor, the number of a box and the ray's far end.
  using leaf_function = void (*)(void* visitor, u32 id, float* far);
  /// Walks the ray origin + t direction, near <= t <= far; `visitor` is handed to `leaf`.
  void intersect(vec3 origin, vec3 direction, float near, float far, leaf_function leaf, void* visitor) const;

  /// Embree's, as "4.3.0".
  static char const* version();

 private:
  struct handles;
  std::unique_ptr<handles> handles_;
};

}  // namespace gart

namespace gart { inline namespace GART_ISA {

namespace trace_kernels {

template <class Response, int Capacity, ray_program P>
struct embree_rays {
  embree_scene const* tree;
  traced_scene scene;
  P program;
  void operator()(index_t i) const {
    if (!program.active(i)) return;
    trace_windows<Capacity, Response>(scene, program, i, [this](auto const& r, auto& visitor) {
      using visitor_type = std::remove_reference_t<decltype(visitor)>;
      tree->intersect(
          origin_of(r), r.direction, visitor.near(), visitor.far(),
          [](void* v, u32 id, float* far) {
            auto& at_leaf = *static_cast<visitor_type*>(v);
            at_leaf.leaf(id);
            *far = at_leaf.far();
          },
          &visitor);
    });
  }
};

}  // namespace trace_kernels

/// A tracer (trace/tracer.hpp) by Embree.
template <host_execution E, class Response = generalized_gaussian<>>
class embree_tracer : public tracer_base {
 public:
  using response_type = Response;                ///< of the Gaussians
  static constexpr char const* name = "embree";  ///< its name in requests

  /// Allocates nothing of the policy; `exec` must outlive it.
  explicit embree_tracer(E& exec) : rays_(exec), boxes_(exec) { static_assert(tracer<embree_tracer, E>); }

  /// View: a camera or a camera model.
  template <class View>
  void prepare(E& exec, gaussians_view<float const> scene, span<ray_gaussian const> gaussians, View const& view,
               trace_options const& options) {
    rays_.cast(exec, view);
    boxes_.resize(scene.count);
    parallel_for(exec, "embree/boxes", scene.count,
                 trace_kernels::bound_ellipsoids<Response>{scene, view.position, options.alpha_min, boxes_});
    stage_scope stage(exec, "embree/build");
    tree_.build(boxes_);
    scene_ = {gaussians.data(), scene.count, options.near};
  }

  /// Of the view that it was prepared for.
  pixel_rays rays() const { return rays_.view(); }
  /// The same, of a view without one centre.
  origin_rays rays_with_origins() const { return rays_.with_origins(); }

  /// Feeds `program` the hits of rays 0 to `rays`; `label` names the launch in profiles.
  template <ray_program P>
  void trace(E& exec, char const* label, index_t rays, P const& program) {
    parallel_for(exec, label, rays, trace_kernels::embree_rays<Response, window, P>{&tree_, scene_, program});
  }

 private:
  static constexpr int window = 16;  // hits of a ray that are kept at a time
  camera_rays<E> rays_;
  buffer<box, E> boxes_;
  embree_scene tree_;
  traced_scene scene_;
};

}}  // namespace gart::GART_ISA
