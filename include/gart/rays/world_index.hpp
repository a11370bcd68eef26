#pragma once
/// \file
/// A tree over a model in a frame of the world, that rays from anywhere are traced by. It is built once, and refitted
/// or built again where the Gaussians change. A batch has a frame of its own (rays/ray_batch.hpp), that its hits are
/// decided in. So the tree only proposes candidates, and its frame changes no bit. What that costs is width. A ray
/// whose frame lies far from the tree's is tested with wider boxes. They are wider by the roundings of the way between
/// the two frames.
///
/// Cost: as bvh_tracer's, once a model in place of once a view. On hosts it is about 0.15 s a million Gaussians and
/// core.

#include <gart/rays/ray_order.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <gart/trace/group_walk.hpp>

namespace gart { inline namespace GART_ISA {

/// The tree as kernels hold it, and the way from its frame to that of the rays.
struct world_view {
  bvh_view tree;     ///< over the ellipsoids' boxes, in the index's frame
  vec3d shift{0.0};  ///< the rays' frame, relative to the index's

  /// A ray in the tree's frame. Its hit lies where float arithmetic in the rays' frame puts it. That is off by up to 32
  /// roundings of what the hit is computed from, as ellipsoid_box has them. It is off by as many of how the ray comes
  /// to this frame.
  GART_HD GART_INLINE placed_ray place(ray const& r) const {
    vec3 const o = r.origin;
    placed_ray out = gart::place(
        ray{{static_cast<float>(shift.x + o.x), static_cast<float>(shift.y + o.y), static_cast<float>(shift.z + o.z)},
            r.direction});
    float const way =
        fabsf(static_cast<float>(shift.x)) + fabsf(static_cast<float>(shift.y)) + fabsf(static_cast<float>(shift.z));
    out.pad += 4e-6f * (way + fabsf(o.x) + fabsf(o.y) + fabsf(o.z));
    return out;
  }
  /// The same for the walk of one ray.
  GART_HD GART_INLINE slab_ray slab_of(ray const& r) const { return slab_ray(place(r)); }
};

/// The tree and its memory.
template <execution E, class Response = generalized_gaussian<>>
class world_index {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit world_index(E& exec) : boxes_(exec), tree_(exec) {}

  /// Anew, in a frame near which most rays begin.
  void build(E& exec, gaussians_view<float const> scene, float alpha_min, vec3d const& frame) {
    frame_ = frame, alpha_min_ = alpha_min;
    bound(exec, scene);
    tree_.build(exec, boxes_);
  }
  /// To where as many Gaussians are now; the order of the tree stays.
  void refit(E& exec, gaussians_view<float const> scene) {
    bound(exec, scene);
    tree_.refit(exec, boxes_);
  }
  /// For rays in a frame.
  world_view seen_from(vec3d const& frame) const { return {tree_.view(), frame - frame_}; }
  /// The point of the world that it is relative to.
  vec3d const& frame() const { return frame_; }
  /// That Gaussians are hit from; those that never are lie in no leaf.
  float alpha_min() const { return alpha_min_; }
  /// Gaussians.
  index_t count() const { return tree_.view().count; }

 private:
  void bound(E& exec, gaussians_view<float const> scene) {
    boxes_.resize(scene.count);
    parallel_for(exec, "rays/boxes", scene.count,
                 trace_kernels::bound_ellipsoids<Response>{scene, frame_, alpha_min_, boxes_});
  }

  buffer<box, E> boxes_;
  bvh<E> tree_;
  vec3d frame_{0.0};
  float alpha_min_ = 0;
};

/// Feeds `program` the hits of rays 0 to `rays`. `scene` has the Gaussians in the frame of the rays. The rays are the
/// program's, of type `ray`, with an end far(i).
template <class Response, execution E, ray_program P>
void trace_batch(E& exec, char const* label, world_view const& index, traced_scene const& scene, index_t rays,
                 ray_order<E>& order, P const& program) {
  static_assert(std::same_as<typename P::ray_type, ray>);
  u32 const* const neighbours = order.of(rays);
  if constexpr (!E::device) {
    trace_beams<Response>(exec, label, index, scene, rays, neighbours, order.apart, program);
  } else {
    // Rays of a batch lie farther apart than pixels do. Where they are too few to fill a device, lanes share them.
    constexpr float widest = 0.03f;
    constexpr index_t few = 1u << 18;
    trace_beams<Response>(
        exec, label, index, scene, rays, neighbours, order.apart, widest, program, [&](u32 const* others) {
          if (rays <= few)
            trace_kernels::trace_groups<Response>(exec, label, index, scene, rays, neighbours, others, program);
          else
            trace_kernels::trace_alone<Response>(exec, label, index, scene, rays, neighbours, others, program);
        });
  }
}

}}  // namespace gart::GART_ISA
