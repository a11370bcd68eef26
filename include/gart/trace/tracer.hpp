#pragma once
/// \file
/// A tracer is prepared for the Gaussians of one view. It feeds a ray program the hits of each of its rays in order,
/// until the program has had enough. Its structure yields candidates only. Which are hits, their t and their alpha come
/// from math/ray_gaussian.hpp. So all tracers give the same hits in the same order, bit for bit.
///
/// A tracer derives from tracer_base and is held to the concept where it is defined. A frame (render/frame.hpp) has
/// one, and calls it in the right order.

#include <gart/bvh/box.hpp>
#include <gart/camera/pixel_rays.hpp>
#include <gart/exec/concepts.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/tiles/tile_map.hpp>
#include <gart/trace/ray_program.hpp>

namespace gart { inline namespace GART_ISA {

/// The options of a tracer.
struct trace_options {
  float alpha_min = 1.0f / 255.0f;  ///< a Gaussian is hit where sigma * rho >= alpha_min
  float near = 0.01f;               ///< hits lie at t > near
  int rebuild_every = 1;            ///< views between two builds of a structure that can be refitted
  image_rows rows = {};             ///< what is traced of the image
};

/// What every tracer needs of the scene: the Gaussians in one frame, and the distance hits begin at.
struct traced_scene {
  /// [count], in the view's frame.
  ray_gaussian const* gaussians = nullptr;
  index_t count = 0;  ///< of Gaussians
  float near = 0;     ///< hits lie at t > near
};

/// Where ray i begins: at its program's near(i), where it has one, else at the scene's near. A program's near(i) is at
/// least the scene's.
template <class P>
GART_HD GART_INLINE float start_of_ray(traced_scene const& scene, P const& program, index_t i) {
  if constexpr (requires { program.near(i); })
    return program.near(i);
  else
    return scene.near;
}

/// Where it ends: at its program's far(i), where it has one.
template <class P>
GART_HD GART_INLINE float end_of_ray(P const& program, index_t i) {
  if constexpr (requires { program.far(i); })
    return program.far(i);
  else
    return infinity;
}

/// The defaults of a tracer.
struct tracer_base {
  static constexpr int tile_size = 8;              ///< side of the tiles that footprints are cut into
  static constexpr bool lends_footprints = false;  ///< it has the view's footprints and lists, of its own tile_size
};

namespace trace_kernels {

/// Stands for every ray program in the concept.
struct no_rays : ray_program_base {
  using ray_type = primary_ray;
  struct state {};
  pixel_order order;
  GART_HD bool active(index_t) const { return false; }
  GART_HD pixel at(index_t i) const { return order.at(i); }
  GART_HD state begin(index_t) const { return {}; }
  GART_HD primary_ray ray_of(index_t, state const&) const { return {}; }
  GART_HD bool on_hit(state&, hit const&) const { return false; }
  GART_HD void end(index_t, state const&) const {}
};
static_assert(pixel_program<no_rays>);

}  // namespace trace_kernels

/// A tracer on the policy E.
template <class T, class E>
concept tracer = execution<E> && std::constructible_from<T, E&> &&
    requires(T& t, T const& prepared, E& e, gaussians_view<float const> scene, span<ray_gaussian const> gaussians,
             camera const& view, trace_options const& options, trace_kernels::no_rays const& program) {
  typename T::response_type;                        // of the Gaussians whose hits it finds (math/response.hpp)
  { T::name } -> std::convertible_to<char const*>;  // "bvh", "tiles", ...
  // `gaussians` are those of `scene` in the view's frame. Both are read until the next prepare. The view is a camera or
  // a camera model (camera/model.hpp).
  t.prepare(e, scene, gaussians, view, options);
  { prepared.rays() } -> std::same_as<pixel_rays>;                // of the view's pixels
  { prepared.rays_with_origins() } -> std::same_as<origin_rays>;  // where they have no one centre
  t.trace(e, "label", index_t{}, program);                        // rays 0 to a number
  // From tracer_base:
  { T::tile_size } -> std::convertible_to<int>;
  { T::lends_footprints } -> std::convertible_to<bool>;
};

/// A tracer that lends the backward pass the footprints that it has measured, and its lists.
template <class T, class E>
concept footprint_tracer = tracer<T, E> && requires(T const& t) {
  requires T::lends_footprints;
  { t.footprints() } -> std::same_as<footprints<E, T::tile_size> const&>;
  { t.map() } -> std::same_as<tile_map_view>;
};

}}  // namespace gart::GART_ISA
