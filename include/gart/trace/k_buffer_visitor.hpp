#pragma once
/// \file
/// Turns candidates into a window of hits. Every traverser that proposes Gaussians one at a time, in no particular
/// order, shares it.

#include <gart/trace/k_buffer.hpp>
#include <gart/trace/tracer.hpp>

namespace gart { inline namespace GART_ISA {

/// Takes the candidates of one ray from a traversal and keeps those that are its next hits.
template <int Capacity, class Ray, class Response = generalized_gaussian<>>
struct k_buffer_visitor {
  traced_scene scene;  ///< what is traced
  Ray ray;             ///< in the frame of the Gaussians
  /// The last hit passed on: only hits strictly after it are taken. At first (near, largest id): t > near.
  float last_t;
  u32 last_id = 0xffffffffu;  ///< the Gaussian of that hit
  k_buffer<Capacity> window;  ///< the next hits

  /// Before the first hit.
  GART_HD GART_INLINE k_buffer_visitor(traced_scene const& s, Ray const& r) : scene(s), ray(r), last_t(s.near) {}

  /// Candidates are wanted whose hits lie at this distance or farther.
  GART_HD GART_INLINE float near() const { return last_t; }
  /// Candidates are wanted whose hits lie at this distance or nearer; it shrinks as the window fills.
  GART_HD GART_INLINE float far() const { return window.far(); }
  /// A candidate: its hit is kept if it is one, and of the nearest.
  GART_HD GART_INLINE void leaf(u32 id) {
    ray_gaussian const g = scene.gaussians[id];
    ray_peak const r = evaluate(g, ray);
    if (is_hit(g, r, scene.near) && before(last_t, last_id, r.t, id) && window.wants(r.t, id))
      window.insert({r.t, id, hit_alpha<Response>(g, r.d2)});
  }
};

/// Feeds `program` the hits of ray i. `gather` proposes candidates to the visitor (at least all whose hits lie in
/// [near(), far()]). It is called again until a window is not full.
template <int Capacity, class Response = generalized_gaussian<>, ray_program P, class Gather>
GART_HD GART_INLINE void trace_windows(traced_scene const& scene, P const& program, index_t i, Gather const& gather) {
  auto state = program.begin(i);
  auto const r = program.ray_of(i, state);
  k_buffer_visitor<Capacity, std::remove_const_t<decltype(r)>, Response> visitor(scene, r);
  visitor.last_t = start_of_ray(scene, program, i);
  bool more = true;
  while (more) {
    visitor.window.clear();
    gather(r, visitor);
    more = visitor.window.full();
    GART_UNROLL
    for (int k = 0; k < Capacity; ++k) {
      if (k >= visitor.window.size()) break;
      hit const h = visitor.window[k];
      visitor.last_t = h.t, visitor.last_id = h.id;
      if (!program.on_hit(state, h)) {
        more = false;
        break;
      }
    }
  }
  program.end(i, state);
}

}}  // namespace gart::GART_ISA
