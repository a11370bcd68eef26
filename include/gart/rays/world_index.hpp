#pragma once
/// \file
/// A tree over a model in a frame of the world, that rays from anywhere are traced by: built once, refitted or built
/// again where the Gaussians change. A batch has a frame of its own (rays/ray_batch.hpp), that its hits are decided in,
/// so that the tree only proposes candidates, and its frame changes no bit. What that costs is width: a ray whose frame
/// lies far from the tree's is tested with boxes that are wider by the roundings of the way between them.
///
/// Cost: as bvh_tracer's, once a model in place of once a view: on hosts about 0.15 s a million Gaussians and core.

#include <gart/bvh/walk.hpp>
#include <gart/trace/bvh_tracer.hpp>

namespace gart { inline namespace GART_ISA {

/// The tree as kernels hold it, and the way from its frame to that of the rays.
struct world_view {
  bvh_view tree;     ///< over the ellipsoids' boxes, in the index's frame
  vec3d shift{0.0};  ///< the rays' frame, relative to the index's

  /// A ray as the tree's boxes are tested against it. Its hit lies where float arithmetic in the rays' frame puts it:
  /// 32 roundings of what it is computed from, as ellipsoid_box has them, and of how the ray comes to this frame.
  GART_HD GART_INLINE slab_ray slab_of(ray const& r) const {
    vec3 const o = r.origin;
    vec3 const moved(static_cast<float>(shift.x + o.x), static_cast<float>(shift.y + o.y),
                     static_cast<float>(shift.z + o.z));
    slab_ray out(ray{moved, r.direction});
    float const way =
        fabsf(static_cast<float>(shift.x)) + fabsf(static_cast<float>(shift.y)) + fabsf(static_cast<float>(shift.z));
    float const pad = -4e-6f * (way + fabsf(o.x) + fabsf(o.y) + fabsf(o.z));
    for (int k = 0; k < 3; ++k) out.narrower[k] += pad * fabsf(out.inverse[k]);
    return out;
  }
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

namespace ray_kernels {

// What a ray still looks for, cut at where it ends.
template <class Visitor>
struct up_to {
  Visitor& visitor;
  float end;
  GART_HD GART_INLINE float near() const { return visitor.near(); }
  GART_HD GART_INLINE float far() const { return smaller(visitor.far(), end); }
  GART_HD GART_INLINE void leaf(u32 id) { visitor.leaf(id); }
};

template <class Response, int Capacity, ray_program P>
struct walk_batch {
  static constexpr int block_size = 128, min_blocks = 1;
  world_view index;
  traced_scene scene;
  P program;
  GART_KERNEL void operator()(index_t i) const {
    if (!program.active(i)) return;
    trace_windows<Capacity, Response>(scene, program, i, [this, i](ray const& r, auto& visitor) {
      up_to<std::remove_reference_t<decltype(visitor)>> limited{visitor, program.far(i)};
      walk(index.tree, index.slab_of(r), limited);
    });
  }
};

}  // namespace ray_kernels

/// Feeds `program` the hits of rays 0 to `rays`. `scene` has the Gaussians in the frame of the rays, which are the
/// program's: of type `ray`, with an end far(i).
template <class Response, execution E, ray_program P>
void trace_batch(E& exec, char const* label, world_view const& index, traced_scene const& scene, index_t rays,
                 P const& program) {
  static_assert(std::same_as<typename P::ray_type, ray>);
  // Hits of a ray that are kept at a time: in registers of a device; on hosts so many that few rays are walked twice.
  constexpr int window = E::device ? 16 : 64;
  parallel_for(exec, label, rays, ray_kernels::walk_batch<Response, window, P>{index, scene, program});
}

}}  // namespace gart::GART_ISA
