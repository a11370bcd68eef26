#pragma once
/// \file
/// The backward pass of a batch: what each ray brings to it, and the form that traces rays again. A ray adds each hit's
/// gradient to its Gaussian, atomically, and keeps the sums that are its own. These are dL/d its origin and its
/// direction, which colours turn with. Formulas are those of math/hit_gradient.hpp and math/sh_turn.hpp.

#include <gart/backward/hit_slot.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/math/sh_turn.hpp>
#include <gart/rays/batch_composite.hpp>

namespace gart { inline namespace GART_ISA {

/// What gradients need of a ray, read 16 bytes at a time.
struct alignas(16) differentiated_ray {
  vec3 origin;     ///< in the batch's frame
  float total;     ///< C.g, of all channels
  vec3 direction;  ///< unit
  float by_depth;  ///< dL/d depth
  vec3 by_color;   ///< dL/d colour
  float unused;    ///< to 48 bytes

  /// The ray itself.
  GART_HD GART_INLINE ray own() const { return {origin, direction}; }
};
static_assert(sizeof(differentiated_ray) == 48);

/// dL/d colour of a hit that was kept, of a ray of gradient g.
GART_HD GART_INLINE vec3 color_gradient_of(hit_entry const& entry, vec3 const& g) {
  float const w = entry.weight();
  return {entry.clamped(0) ? 0.0f : w * g.x, entry.clamped(1) ? 0.0f : w * g.y, entry.clamped(2) ? 0.0f : w * g.z};
}

/// Its dL/dalpha. `depth`: what the ray's would be if the hit were opaque.
template <class Response>
GART_HD GART_INLINE float alpha_gradient_of(hit_entry const& entry, float depth, differentiated_ray const& from,
                                            ray_gaussian const& gaussian, ray_peak const& r) {
  vec3 const g = from.by_color, opaque = entry.color();
  float const opaque_g = opaque.x * g.x + opaque.y * g.y + opaque.z * g.z + depth * from.by_depth;
  return alpha_gradient(opaque_g, from.total, estimated_hit_alpha<Response>(gaussian, r.d2));
}

/// dL/dw of a small turn of a ray by the colour of Gaussian `id` that it sees. The colour's gradient is g.
GART_HD GART_INLINE vec3 turn_by_color(color_rows const& colors, sh_basis<color_rows::most> const& basis, u32 id,
                                       vec3 const& g) {
  constexpr int bands = sh_basis<color_rows::most>::size;
  float const* const row = colors.sh + static_cast<std::size_t>(3 * sh_coefficients(colors.stored_degree)) * id;
  int const active = sh_coefficients(colors.active_degree);
  float by_band[bands];
  GART_UNROLL
  for (int k = 0; k < bands; ++k)
    by_band[k] = k < active ? row[3 * k] * g.x + row[3 * k + 1] * g.y + row[3 * k + 2] * g.z : 0.0f;
  return sh_turn<color_rows::most, 1>(by_band, basis.y);
}

namespace ray_kernels {

// Null where there is no such gradient.
struct gather_rays {
  batch_rays rays;
  float const *color, *depth, *transmittance;           // as the forward pass left them
  float const *by_color, *by_depth, *by_transmittance;  // dL/d these
  differentiated_ray* out;
  GART_KERNEL void operator()(index_t i) const {
    ray const r = rays.of(i);
    differentiated_ray d{r.origin, 0, r.direction, by_depth ? by_depth[i] : 0.0f, vec3(0.0f), 0};
    if (by_color) {
      float const *c = color + std::size_t{3} * i, *g = by_color + std::size_t{3} * i;
      d.by_color = {g[0], g[1], g[2]};
      d.total = c[0] * g[0] + c[1] * g[1] + c[2] * g[2];
    }
    if (by_depth) d.total += depth[i] * d.by_depth;
    if (by_transmittance) d.total += transmittance[i] * by_transmittance[i];
    out[i] = d;
  }
};

// Adds what channels (channels/differentiate.hpp) bring to the gradients of rays.
template <class Response>
struct add_channels {
  batch_rays rays;
  hit_table_view hits;
  float const *by_alpha, *alongs;
  ray_gaussian const* records;
  ray_gradient_targets out;
  GART_KERNEL void operator()(index_t i) const {
    ray const own = rays.of(i);
    vec3 by_origin(0.0f), by_direction(0.0f);
    for (u64 k = hits.offsets[i]; k < hits.offsets[i + 1]; ++k) {
      ray_gaussian const gaussian = records[hits.ids[k]];
      ray_peak const r = evaluate(gaussian, own);
      float const along = alongs ? alongs[k] : 0.0f;
      moments_of<float> const m = hit_moments_with_depth<Response>(gaussian, r, by_alpha[k], along, true);
      ray_part const part = ray_part_of(gaussian, r, m, along);
      by_origin += part.origin, by_direction += part.direction;
    }
    by_direction = rays.gradient_of_given(i, own.direction, by_direction);
    for (int c = 0; c < 3; ++c) {
      std::size_t const at = std::size_t{3} * i + static_cast<std::size_t>(c);
      if (out.origins) out.origins[at] += by_origin[c];
      if (out.directions) out.directions[at] += by_direction[c];
    }
  }
};

}  // namespace ray_kernels

/// The ray program of the backward pass. Targets that are null are left out.
template <class Response, execution E>
struct batch_scatter : ray_program_base {
  using ray_type = ray;                                           ///< from anywhere
  static constexpr int bands = sh_basis<color_rows::most>::size;  ///< SH functions, at most
  /// A ray on its way.
  struct state {
    ray own;                           ///< the ray
    float far;                         ///< where it ends
    sh_basis<color_rows::most> basis;  ///< of its direction
    ray_gradient gradient;             ///< what is left behind the hit
    float by_depth;                    ///< dL/d depth
    u32 left;                          ///< hits until the cap; from 0, no cap, it counts down past it
    vec3 by_origin{0.0f};              ///< sums over the hits
    vec3 by_direction{0.0f};           ///< the same
    vec3 by_turn{0.0f};                ///< of colours, by a turn of the direction
  };

  batch_rays rays;                                     ///< of the batch
  differentiated_ray const* differentiated = nullptr;  ///< [R]
  color_rows colors;                                   ///< of the scene
  float transmittance_min = 0;                         ///< as the forward pass had it
  u32 max_hits = 0;                                    ///< as the forward pass had it
  ray_gaussian const* records = nullptr;               ///< [N], in the batch's frame
  int sh_stride = 0;                                   ///< floats of a row of sh_gradient
  float* sh_gradient = nullptr;                        ///< [N][K][3]; null: no gradients of Gaussians
  float* moments_out = nullptr;                        ///< [N][moment_stride]
  ray_gradient_targets of_rays;                        ///< dL/d rays

  /// Every ray is one.
  GART_HD bool active(index_t) const { return true; }
  /// Where ray i ends.
  GART_HD float far(index_t i) const { return rays.far(i); }
  /// The state before the first hit.
  GART_HD state begin(index_t i) const {
    differentiated_ray const r = differentiated[i];
    state s;
    s.own = r.own(), s.far = rays.far(i);
    s.basis = sh_basis<color_rows::most>(r.direction);
    s.gradient.g = r.by_color, s.gradient.color_g = r.total;
    s.by_depth = r.by_depth;
    s.left = max_hits;
    return s;
  }
  /// Ray i, in the batch's frame.
  GART_HD ray ray_of(index_t, state const& s) const { return s.own; }

  /// Adds a hit's gradient. False: the ray ends.
  GART_KERNEL GART_INLINE bool on_hit(state& s, hit const& h) const {
    if (h.t > s.far) return false;
    vec3 const unclamped = colors.unclamped(s.basis, h.id);
    float weight;
    float const hit_g = s.gradient.of(clamped_color(unclamped)) + h.t * s.by_depth;
    float const by_alpha = s.gradient.pass(h.alpha, hit_g, weight);
    vec3 const g = color_gradient_of(unclamped, s.gradient.g, weight);
    ray_gaussian const gaussian = records[h.id];
    ray_peak const r = evaluate(gaussian, s.own);
    moments_of<float> const m = hit_moments_with_depth<Response>(gaussian, r, by_alpha, weight * s.by_depth, true);
    if (sh_gradient) {
      add_color(s, h.id, g);
      E::atomic_add_row(moments_out + std::size_t{moment_stride} * h.id, m.v, error_place);
    }
    if (of_rays.origins || of_rays.directions) {
      ray_part const part = ray_part_of(gaussian, r, m, weight * s.by_depth);
      s.by_origin += part.origin, s.by_direction += part.direction;
      s.by_turn += turn_by_color(colors, s.basis, h.id, g);
    }
    return s.gradient.transmittance >= transmittance_min && --s.left != 0;
  }

  /// Writes what is the ray's own.
  GART_HD void end(index_t i, state const& s) const {
    std::size_t const at = std::size_t{3} * i;
    if (of_rays.origins) {
      float* const to = of_rays.origins + at;
      to[0] = s.by_origin.x, to[1] = s.by_origin.y, to[2] = s.by_origin.z;
    }
    if (of_rays.directions) {
      vec3 const &d = s.own.direction, &w = s.by_turn;
      // A turn w moves the direction by w x d.
      vec3 const by = rays.gradient_of_given(i, d, s.by_direction + glm::cross(w, d));
      float* const to = of_rays.directions + at;
      to[0] = by.x, to[1] = by.y, to[2] = by.z;
    }
  }

 private:
  GART_KERNEL GART_INLINE void add_color(state const& s, u32 id, vec3 const& g) const {
    float* const row = sh_gradient + static_cast<std::size_t>(sh_stride) * id;
    int const active = sh_coefficients(colors.active_degree);
    if (sh_stride == 3 * bands) {
      float sum[3 * bands] = {};
      GART_UNROLL
      for (int k = 0; k < bands; ++k) {
        if (k == active) break;
        sum[3 * k] = s.basis.y[k] * g.x, sum[3 * k + 1] = s.basis.y[k] * g.y, sum[3 * k + 2] = s.basis.y[k] * g.z;
      }
      E::atomic_add_row(row, sum, 3 * active);
    } else {
      GART_UNROLL
      for (int k = 0; k < bands; ++k) {
        if (k == active) break;
        float const sum[3] = {s.basis.y[k] * g.x, s.basis.y[k] * g.y, s.basis.y[k] * g.z};
        E::atomic_add_row(row + 3 * k, sum, 3);
      }
    }
  }
};

}}  // namespace gart::GART_ISA
