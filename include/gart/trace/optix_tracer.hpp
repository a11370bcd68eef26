#pragma once
/// \file
/// The traverser on OptiX, for the CUDA policy. OptiX lists the boxes that each ray meets, and math/ray_gaussian.hpp
/// decides which are hits. They are those of the BVH tracer, bit for bit. Rays go in chunks. One launch counts their
/// boxes, the next writes the numbers, and a kernel of gart's composites them. Link gart::optix; this header needs no
/// OptiX.
///
/// The tree is over boxes in the frame, the ellipsoid_box of bvh/box.hpp. Instances of one ellipsoid would be tested in
/// OptiX's own float arithmetic. Its transform to the ellipsoid's space may lose a ray that grazes a thin one.
///
/// Memory: 24 bytes a Gaussian and OptiX's tree; 44 bytes a ray and 4 a candidate of a chunk. Waits for the device
/// once a chunk. Errors: unsupported where the driver has no OptiX, or not that of the build. The same where a Gaussian
/// or a ray lies farther from the frame than OptiX's coordinates are used to.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/reduce.hpp>
#include <gart/bvh/cross.hpp>
#include <gart/exec/cuda.hpp>
#include <gart/scene/parameters.hpp>
#include <gart/trace/k_buffer_visitor.hpp>
#include <gart/trace/tracer.hpp>

#include <memory>
#include <string>

namespace gart {

/// A ray as OptiX takes it; none where far < near.
struct optix_ray {
  vec3 origin;     ///< in the frame of the boxes
  float near = 0;  ///< boxes are met from here
  vec3 direction;  ///< unit
  float far = -1;  ///< to here
};

/// OptiX's tree over boxes, in the memory of a policy that outlives it.
class optix_scene {
 public:
  static constexpr float largest_coordinate = 1e15f;  ///< of boxes and origins
  static constexpr float farthest = 1e16f;            ///< of a ray

  /// No boxes yet. Errors: unsupported, with the reason, where the driver's OptiX does not start.
  explicit optix_scene(cuda_exec& exec);
  ~optix_scene();
  /// The other is left empty.
  optix_scene(optix_scene&&) noexcept;
  /// The other is left empty.
  optix_scene& operator=(optix_scene&&) noexcept;

  /// Boxes in the policy's memory, none of them empty; they are not kept. `refittable` costs some speed.
  void build(span<box const> boxes, bool refittable);
  /// As many boxes as the last build had, which was refittable. Errors: invalid_argument for others.
  void refit(span<box const> boxes);
  /// Whether refit() takes so many boxes.
  bool can_refit(std::size_t boxes) const;

  /// The number of boxes that each ray meets, [rays].
  void count(span<optix_ray const> rays, span<u32> counts);
  /// Their numbers in no order, from ids[offsets[r]], for the rays and counts of the last count().
  void list(span<optix_ray const> rays, span<u32> counts, span<u64 const> offsets, span<u32> ids);
  /// Waits. Errors: gart::error where list() met other boxes than count().
  void require_same() const;

  /// Of the headers, as "9.0.0".
  static char const* version();

 private:
  struct handles;
  std::unique_ptr<handles> handles_;
};

/// Whether the driver of the current device has the OptiX of the build; `reason` says why not.
bool optix_available(std::string* reason = nullptr);

}  // namespace gart

namespace gart { inline namespace GART_ISA {

namespace optix_kernels {

// Of what is never hit the box is a point at the frame's origin. `pad` is for rays from elsewhere (bvh/cross.hpp).
template <class Response>
struct bound_ellipsoids {
  gaussians_view<float const> scene;
  vec3d frame;
  float alpha_min, pad;
  span<box> boxes;
  u32* beyond;  // set where a box is
  GART_KERNEL void operator()(index_t i) const {
    box b = ellipsoid_box<Response>(load_parameters(scene, i), frame, alpha_min);
    if (b.lo.x > b.hi.x) b = {vec3(0.0f), vec3(0.0f)};
    b.lo -= vec3(pad), b.hi += vec3(pad);
    for (int k = 0; k < 3; ++k)
      if (!(b.lo[k] > -optix_scene::largest_coordinate && b.hi[k] < optix_scene::largest_coordinate)) *beyond = 1;
    boxes[i] = b;
  }
};

// Ray `first` and those after it. A ray that is not finite has no hits.
template <ray_program P>
struct cast {
  traced_scene scene;
  P program;
  index_t first;
  span<optix_ray> rays;
  float* reach;  // of the origins; null where rays begin at the frame's origin
  GART_KERNEL void operator()(index_t k) const {
    optix_ray out{vec3(0.0f), 0.0f, vec3(0.0f), -1.0f};
    index_t const i = first + k;
    if (program.active(i)) {
      auto const state = program.begin(i);
      auto const r = program.ray_of(i, state);
      out.origin = origin_of(r), out.direction = r.direction;
      out.near = larger(start_of_ray(scene, program, i), 0.0f);
      float const sum =
          out.origin.x + out.origin.y + out.origin.z + out.direction.x + out.direction.y + out.direction.z + out.near;
      if (is_finite(sum)) out.far = smaller(end_of_ray(program, i), optix_scene::farthest);
    }
    rays[k] = out;
    if (reach) reach[k] = out.far < 0 ? 0.0f : fabsf(out.origin.x) + fabsf(out.origin.y) + fabsf(out.origin.z);
  }
};

template <class Response, ray_program P>
struct meet_candidates {
  static constexpr int window = 16;  // hits of a ray that are kept at a time
  traced_scene scene;
  P program;
  index_t first;
  span<u64 const> offsets;
  span<u32 const> ids;
  GART_KERNEL void operator()(index_t k) const {
    if (!program.active(first + k)) return;
    trace_windows<window, Response>(scene, program, first + k, [&](auto const&, auto& visitor) {
      for (u64 at = offsets[k]; at < offsets[k + 1]; ++at) visitor.leaf(ids[at]);
    });
  }
};

}  // namespace optix_kernels

/// A tracer (trace/tracer.hpp) by OptiX.
template <std::same_as<cuda_exec> E, class Response = generalized_gaussian<>>
class optix_tracer : public tracer_base {
 public:
  using response_type = Response;               ///< of the Gaussians
  static constexpr char const* name = "optix";  ///< its name in requests

  /// Starts OptiX on the policy's device; `exec` must outlive it.
  explicit optix_tracer(E& exec)
      : view_rays_(exec),
        boxes_(exec),
        beyond_(exec),
        tree_(exec),
        rays_(exec),
        reach_(exec),
        counts_(exec),
        offsets_(exec),
        ids_(exec) {
    static_assert(tracer<optix_tracer, E>);
  }

  /// View: a camera or a camera model.
  template <class View>
  void prepare(E& exec, gaussians_view<float const> scene, span<ray_gaussian const> gaussians, View const& view,
               trace_options const& options) {
    view_rays_.cast(exec, view);
    seen_ = scene, frame_ = view.position, alpha_min_ = options.alpha_min, reached_ = 0;
    scene_ = {gaussians.data(), scene.count, options.near};
    refittable_ = options.rebuild_every > 1;
    bool const rebuild = !tree_.can_refit(scene.count) || ++age_ >= options.rebuild_every;
    if (rebuild) age_ = 0;
    fit(exec, rebuild);
  }

  /// Of the view that it was prepared for.
  pixel_rays rays() const { return view_rays_.view(); }
  /// The same, of a view without one centre.
  origin_rays rays_with_origins() const { return view_rays_.with_origins(); }

  /// Feeds `program` the hits of rays 0 to `rays`; `label` names the launch in profiles.
  template <ray_program P>
  void trace(E& exec, char const* label, index_t rays, P const& program) {
    stage_scope stage(exec, label);
    index_t chunk = largest_chunk;
    for (index_t first = 0; first < rays;) {
      index_t const n = rays - first < chunk ? rays - first : chunk;
      cast(exec, first, n, program);
      counts_.resize(n), offsets_.resize(n + 1);
      tree_.count(rays_, counts_);
      exclusive_scan(exec, span<u32 const>(counts_), offsets_.view(), offsets_.view().subspan(n, 1));
      u64 candidates = 0;
      exec.copy_out(&candidates, offsets_.data() + n, sizeof candidates);
      if (candidates > most_candidates && n > smallest_chunk) {
        chunk = n / 2;
        continue;
      }
      ids_.resize(candidates);
      if (candidates > 0) tree_.list(rays_, counts_, offsets_, ids_);
      parallel_for(exec, "optix/hits", n,
                   optix_kernels::meet_candidates<Response, P>{scene_, program, first, offsets_, ids_});
      first += n;
    }
    tree_.require_same();
  }

 private:
  static constexpr index_t largest_chunk = 1u << 19, smallest_chunk = 1024;  // rays
  static constexpr u64 most_candidates = u64{1} << 27;                       // of a larger chunk

  template <ray_program P>
  void cast(E& exec, index_t first, index_t n, P const& program) {
    constexpr bool from_anywhere = std::same_as<typename P::ray_type, ray>;
    rays_.resize(n), reach_.resize(from_anywhere ? n + 1 : 0);
    parallel_for(exec, "optix/rays", n,
                 optix_kernels::cast<P>{scene_, program, first, rays_, from_anywhere ? reach_.data() : nullptr});
    if constexpr (from_anywhere) {
      float reach = 0;
      reduce<float>(exec, reach_.view().subspan(0, n), reach_.view().subspan(n, 1), reduction::max);
      exec.copy_out(&reach, reach_.data() + n, sizeof reach);
      if (reach <= reached_) return;
      if (!(reach < optix_scene::largest_coordinate))
        throw unsupported(
            "a ray begins 1e15 units from the frame, where OptiX loses it: take another tracer "
            "(configuration_request.tracer = bvh), or rays from nearer");
      reached_ = reach;
      fit(exec, !tree_.can_refit(scene_.count));
    }
  }

  // The tree over the boxes of the view, wide enough for origins up to reached_.
  void fit(E& exec, bool rebuild) {
    boxes_.resize(scene_.count), beyond_.resize(1);
    beyond_.zero();
    parallel_for(
        exec, "optix/boxes", scene_.count,
        optix_kernels::bound_ellipsoids<Response>{
            seen_, frame_, alpha_min_, place(ray{vec3(reached_, 0, 0), vec3(0.0f)}).pad, boxes_, beyond_.data()});
    if (beyond_.front())
      throw unsupported(
          "a Gaussian reaches 1e15 units from the camera, where OptiX loses it: take another tracer "
          "(configuration_request.tracer = tiles or bvh), or remove it");
    stage_scope stage(exec, "optix/build");
    if (rebuild)
      tree_.build(boxes_, refittable_);
    else
      tree_.refit(boxes_);
  }

  camera_rays<E> view_rays_;
  buffer<box, E> boxes_;
  buffer<u32, E> beyond_;
  optix_scene tree_;
  buffer<optix_ray, E> rays_;
  buffer<float, E> reach_;
  buffer<u32, E> counts_;
  buffer<u64, E> offsets_;
  buffer<u32, E> ids_;
  traced_scene scene_;
  gaussians_view<float const> seen_;
  vec3d frame_{0.0};
  float alpha_min_ = 0, reached_ = 0;
  bool refittable_ = false;
  int age_ = 0;
};

}}  // namespace gart::GART_ISA
