#pragma once
/// \file
/// The forward pass of a batch: front-to-back compositing of the hits of a ray. Its arithmetic is that of an image's
/// pixels (render/composite.hpp). It also finds the distances and Gaussians that a sensor asks for. One program serves
/// all SH degrees: coefficients are read in their stride.

#include <gart/backward/hit_slot.hpp>
#include <gart/channels/hit_table.hpp>
#include <gart/math/blend.hpp>
#include <gart/math/sh.hpp>
#include <gart/rays/batch_rays.hpp>
#include <gart/rays/hit_runs.hpp>
#include <gart/render/composite.hpp>

namespace gart { inline namespace GART_ISA {

/// The coefficients of all Gaussians, of any degree.
struct color_rows {
  static constexpr int most = 3;  ///< degree
  float const* sh = nullptr;      ///< [N][K][3], K of stored_degree
  int stored_degree = 0;          ///< of the rows
  int active_degree = 0;          ///< bands above it are not evaluated

  /// The colour of a Gaussian along a direction, before the clamp.
  GART_HD GART_INLINE vec3 unclamped(sh_basis<most> const& basis, u32 id) const {
    float const* const row = sh + static_cast<std::size_t>(3 * sh_coefficients(stored_degree)) * id;
#if defined(__CUDACC__)
    // Whole rows lie on 16 bytes and are read so.
    if (stored_degree == most) return basis.unclamped(sh_row<most>(row, active_degree).v);
#endif
    return basis.unclamped(row, sh_coefficients(active_degree));
  }
};

/// Keeps no hits.
struct keep_none {
  static constexpr bool any = false;  ///< none is kept
  struct hit {};                      ///< nothing of one
  struct state {};                    ///< nothing
};

/// What the gradient needs of a hit. It lies together, since hits are read in another order than they are written.
struct alignas(32) kept_hit {
  hit_entry entry;     ///< of its colour
  float depth;         ///< that the ray would have if the hit were opaque
  u32 id;              ///< the Gaussian
  u32 ray_number = 0;  ///< whose it is
};

/// Keeps what the gradient needs of each hit, for a sum by Gaussian (rays/batch_gather.hpp).
template <execution E>
struct keep_hits {
  static constexpr bool any = true;             ///< some are kept
  using hit = kept_hit;                         ///< what is kept of one
  using state = typename run_writer<E>::state;  ///< of a ray
  run_writer<E> runs;                           ///< where they go
  u32* ids = nullptr;                           ///< [places]: Gaussians
  hit* hits = nullptr;                          ///< [places]

  /// Keeps a hit of a ray, that of number k.
  GART_KERNEL GART_INLINE void keep(state& s, index_t ray_number, u32 k, hit const& h) const {
    runs.put(s, ray_number, k, [&](u64 at) { write(at, ray_number, h); });
  }
  /// Keeps so many hits of a ray from number `first`, a lane each.
  GART_KERNEL GART_INLINE void keep_together(state& s, index_t ray_number, u32 first, u32 count,
                                             group_values<hit>& taken) const {
    runs.put_together(s, ray_number, first, count, [&](int l, u64 at) { write(at, ray_number, taken[l]); });
  }
  /// After the last one.
  GART_KERNEL GART_INLINE void end(index_t ray_number, u32 count) const { runs.counts[ray_number] = count; }

 private:
  GART_KERNEL GART_INLINE void write(u64 at, index_t ray_number, hit const& h) const {
    ids[at] = h.id, hits[at] = {h.entry, h.depth, h.id, ray_number};
  }
};

/// The ray program (trace/ray_program.hpp). Keep: keep_none or keep_hits.
template <class Keep = keep_none>
struct batch_composite : ray_program_base {
  using ray_type = ray;                  ///< from anywhere
  using taken_hit = typename Keep::hit;  ///< what is kept of one
  /// A ray on its way.
  struct state : composited_hits<float> {
    index_t number;                                   ///< of the ray
    ray own;                                          ///< the ray
    float far;                                        ///< where it ends
    sh_basis<color_rows::most> basis;                 ///< of its direction
    float first = no_hit, median = no_hit;            ///< t of these hits
    u32 first_id = no_gaussian;                       ///< of the first hit
    u32 median_id = no_gaussian;                      ///< of the median hit
    u32 top_id = no_gaussian;                         ///< of the largest weight
    float top_weight = 0;                             ///< the largest weight
    [[no_unique_address]] typename Keep::state kept;  ///< places
  };

  batch_rays rays;         ///< of the batch
  color_rows colors;       ///< of the scene
  render_options options;  ///< thresholds, cap and background
  batch_targets out;       ///< where it all goes
  Keep keep;               ///< what a backward pass wants to find of each hit

  /// Every ray is one.
  GART_HD bool active(index_t) const { return true; }
  /// Where ray i ends.
  GART_HD float far(index_t i) const { return rays.far(i); }
  /// The state before the first hit.
  GART_HD state begin(index_t i) const {
    state s;
    s.number = i, s.own = rays.of(i), s.far = rays.far(i);
    s.basis = sh_basis<color_rows::most>(s.own.direction);
    return s;
  }
  /// Ray i, in the batch's frame.
  GART_HD ray ray_of(index_t, state const& s) const { return s.own; }

  /// The colour of a Gaussian as the ray sees it, before the clamp. Where lanes look up colours for one another, the
  /// basis is computed anew: it would fill the registers of the walk between.
  GART_HD GART_INLINE vec3 shade(state const& s, u32 id) const {
    return colors.unclamped(sh_basis<color_rows::most>(s.own.direction), id);
  }
  /// Composites a hit. False: the ray ends.
  GART_KERNEL GART_INLINE bool on_hit(state& s, hit const& h) const {
    if (h.t > s.far) return false;
    taken_hit taken;
    bool const goes_on = take(s, h, colors.unclamped(s.basis, h.id), taken);
    if constexpr (Keep::any) keep.keep(s.kept, s.number, s.hits - 1, taken);
    return goes_on;
  }
  /// The same of a hit before the ray's end, of that colour; it is not kept yet.
  GART_HD GART_INLINE bool take(state& s, hit const& h, vec3 const& unclamped, taken_hit& taken) const {
    vec3 const c = clamped_color(unclamped);
    [[maybe_unused]] vec3 const opaque = opaque_color(c, s.color, s.transmittance);
    [[maybe_unused]] float const depth = opaque_depth(h.t, s.depth, s.transmittance);
    float const weight = blend(h.alpha, h.t, c, s.color, s.depth, s.transmittance);
    if constexpr (Keep::any)
      taken = {hit_entry::of(opaque, weight, unclamped), depth, h.id};
    else
      taken = {};
    if (s.hits++ == 0) s.first = h.t, s.first_id = h.id;
    if (s.median_id == no_gaussian && s.transmittance < 0.5f) s.median = h.t, s.median_id = h.id;
    if (weight > s.top_weight) s.top_weight = weight, s.top_id = h.id;
    return s.transmittance >= options.transmittance_min && s.hits != options.max_hits;
  }
  /// Keeps so many that were taken, a lane each.
  GART_KERNEL GART_INLINE void keep_together(state& s, u32 count, group_values<taken_hit>& taken) const {
    if constexpr (Keep::any) keep.keep_together(s.kept, s.number, s.hits - count, count, taken);
  }

  /// Writes what the ray saw.
  GART_KERNEL GART_INLINE void end(index_t i, state& s) const {
    if constexpr (Keep::any) keep.end(i, s.hits);
    if (out.color) {
      vec3 const c = s.color + s.transmittance * options.background;
      float* const to = out.color + std::size_t{3} * i;
      to[0] = c.x, to[1] = c.y, to[2] = c.z;
    }
    if (out.transmittance) out.transmittance[i] = s.transmittance;
    if (out.depth) out.depth[i] = s.depth;
    if (out.median) out.median[i] = s.median;
    if (out.first) out.first[i] = s.first;
    if (out.hits) out.hits[i] = s.hits;
    if (out.first_id) out.first_id[i] = s.first_id;
    if (out.median_id) out.median_id[i] = s.median_id;
    if (out.top_id) out.top_id[i] = s.top_id;
  }
};
static_assert(ray_program<batch_composite<>>);

}}  // namespace gart::GART_ISA
