#pragma once
/// \file
/// The rays of a beam and the Gaussians that it comes across (trace/beam_walk.hpp). Each ray evaluates all of them and
/// keeps its hits. On a device a lane is a ray, and Gaussians are read once for all. On a host rays fill registers.

#include <gart/math/ray_gaussian.hpp>
#include <gart/trace/lane_hits.hpp>
#include <gart/trace/tracer.hpp>

#if !defined(__CUDACC__)
#include <gart/math/lanes.hpp>
#endif

namespace gart { inline namespace GART_ISA {

/// A ray of a beam on its way.
template <class Ray, int Waiting>
struct beam_ray {
  index_t number;              ///< of the ray
  bool active;                 ///< there is one
  bool alive;                  ///< it wants more hits
  Ray own;                     ///< the ray
  float last_t;                ///< the last hit passed on: at first (near, largest id), t > near
  u32 last_id;                 ///< the Gaussian of that hit
  float end;                   ///< where the ray ends
  hits_of_lane<Waiting> hits;  ///< found and not passed on
};

namespace trace_kernels {

#if defined(__CUDA_ARCH__)

// The Gaussians of n candidates, to where all lanes read them.
__device__ GART_INLINE void stage(ray_gaussian* staged, traced_scene const& scene, u32 const* ids, int n) {
  constexpr int words = sizeof(ray_gaussian) / sizeof(quad);
  for (int w = static_cast<int>(threadIdx.x); w < words * n; w += beam_lanes)
    reinterpret_cast<quad*>(staged)[w] = reinterpret_cast<quad const*>(scene.gaussians + ids[w / words])[w % words];
}

// v[c] of an array in registers.
template <int N>
__device__ GART_INLINE float pick(float const (&v)[N], int c) {
  float out = v[0];
  GART_UNROLL
  for (int k = 1; k < N; ++k) out = c == k ? v[k] : out;
  return out;
}

// Of each group of four a ray takes its own hits. So few lanes are idle where a candidate is a hit of some rays alone.
template <class Response, class Ray, int Waiting>
__device__ GART_INLINE void meet_staged(beam_ray<Ray, Waiting>& my, lane_hits<Waiting>& memory,
                                        ray_gaussian const* staged, traced_scene const& scene, u32 const* ids, int n) {
  if (!my.alive) return;
  constexpr int group = 4;
  int const lane = static_cast<int>(threadIdx.x);
  for (int first = 0; first < n; first += group) {
    float t[group], d2[group];
    u32 found = 0;
    GART_UNROLL
    for (int c = 0; c < group; ++c) {
      ray_peak const r = evaluate(staged[first + c], my.own);
      t[c] = r.t, d2[c] = r.d2;
      bool const is_new = first + c < n && is_hit(staged[first + c], r, scene.near) &&
                          before(my.last_t, my.last_id, r.t, ids[first + c]);
      found |= (is_new ? 1u : 0u) << c;
    }
    for (; found; found &= found - 1) {
      int const c = __ffs(static_cast<int>(found)) - 1;
      my.hits.insert(memory, lane, {pick(t, c), ids[first + c], hit_alpha<Response>(staged[first + c], pick(d2, c))});
    }
  }
}

#elif defined(__CUDACC__)

template <class Response, class Ray, int Waiting>
void meet_candidates(per_lane<beam_ray<Ray, Waiting> >& own, lane_hits<Waiting>& memory, traced_scene const& scene,
                     u32 const* ids, int n) {
  for (int c = 0; c < n; ++c) {
    ray_gaussian const g = scene.gaussians[ids[c]];
    for (int l = 0; l < beam_lanes; ++l) {
      beam_ray<Ray, Waiting>& my = own[l];
      if (!my.alive) continue;
      ray_peak const r = evaluate(g, my.own);
      if (is_hit(g, r, scene.near) && before(my.last_t, my.last_id, r.t, ids[c]))
        my.hits.insert(memory, l, {r.t, ids[c], hit_alpha<Response>(g, r.d2)});
    }
  }
}

#else

template <class Lanes>
GART_INLINE void pack(primary_ray_of<lanes>& to, Lanes& own, int first) {
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < lane_count; ++l) to.direction[k].v[l] = own[first + l].own.direction[k];
}
template <class Lanes>
GART_INLINE void pack(ray_of<lanes>& to, Lanes& own, int first) {
  for (int k = 0; k < 3; ++k)
    for (int l = 0; l < lane_count; ++l)
      to.origin[k].v[l] = own[first + l].own.origin[k], to.direction[k].v[l] = own[first + l].own.direction[k];
}

// As many rays at a time as a register holds.
template <class Response, class Ray, int Waiting>
void meet_candidates(per_lane<beam_ray<Ray, Waiting> >& own, lane_hits<Waiting>& memory, traced_scene const& scene,
                     u32 const* ids, int n) {
  u32 const all_alive = lanes_where([&](int l) { return own[l].alive; });
  for (int c = 0; c < n; ++c) prefetch(&scene.gaussians[ids[c]]);
  for (int first = 0; first < beam_lanes; first += lane_count) {
    u32 const alive = all_alive >> first & ((1u << lane_count) - 1);
    if (!alive) continue;
    std::conditional_t<std::is_same_v<Ray, ray>, ray_of<lanes>, primary_ray_of<lanes> > packed;
    pack(packed, own, first);
    lanes last;
    for (int l = 0; l < lane_count; ++l) last.v[l] = own[first + l].last_t;
    for (int c = 0; c < n; ++c) {
      ray_gaussian const& g = scene.gaussians[ids[c]];
      auto const r = evaluate(g, packed);
      u32 found = bits_of(is_hit(g, r, scene.near) & (r.t >= last)) & alive;
      if (!found) continue;
      lanes const alpha = hit_alpha<Response>(g, r.d2);
      for (; found; found &= found - 1) {
        int const l = __builtin_ctz(found);
        beam_ray<Ray, Waiting>& my = own[first + l];
        if (before(my.last_t, my.last_id, r.t.v[l], ids[c]))
          my.hits.insert(memory, first + l, {r.t.v[l], ids[c], alpha.v[l]});
      }
    }
  }
}

#endif

}  // namespace trace_kernels

}}  // namespace gart::GART_ISA
