#pragma once
// The forward ray program: front-to-back compositing of the hits of a pixel,
//   C += T alpha c,  T *= 1 - alpha,
// colour from spherical harmonics on the ray's direction, until T < transmittance_min (the hit that crosses counts), or
// until max_hits of them where there is such a cap.
// The background is added with what transmittance is left.

#include <gart/math/blend.hpp>
#include <gart/math/sh.hpp>
#include <gart/render/options.hpp>
#include <gart/render/record.hpp>
#include <gart/scene/gaussians.hpp>

namespace gart::inline GART_ISA {

// Where a ray's list ends; before every hit where it has none. Places stand for ids: those of the hits of a pixel have
// the order of their Gaussians.
struct last_hit {
  float t = -1;
  u32 place = 0;  // what the record calls it by
};

// Row-major, one entry a pixel; null where not wanted.
struct image_targets {
  float* color = nullptr;          // [3], background composited
  float* transmittance = nullptr;  // after the last hit
  float* depth = nullptr;          // sum of weight * t
  u32* hits = nullptr;             // composited
  last_hit* last = nullptr;        // the hit that the ray ended with
};

template <int ShDegree, class Record>
struct composite {
  using ray_type = primary_ray;
  struct state {
    pixel at;
    vec3 direction;
    sh_basis<ShDegree> basis;
    vec3 color{0.0f};
    float transmittance = 1;
    float depth = 0;
    u32 hits = 0;
    last_hit last;
  };

  pixel_rays rays;
  pixel_order order;
  float const* sh = nullptr;
  int active_degree = ShDegree;
  render_options options;
  image_targets out;
  Record record;

  GART_HD bool active(index_t i) const { return order.inside(order.at(i)); }
  GART_HD pixel at(index_t i) const { return order.at(i); }
  GART_HD state begin(index_t i) const {
    state s;
    s.at = order.at(i);
    s.direction = pixel_ray(rays, s.at).direction;
    s.basis = sh_basis<ShDegree>(s.direction);
    return s;
  }
  GART_HD primary_ray ray_of(index_t, state const& s) const { return {s.direction}; }
  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const {
    constexpr std::size_t stride = row_floats;
    vec3 const unclamped = s.basis.unclamped(sh_row<ShDegree>(sh + stride * h.id, active_degree).v);
    return add(s, h.t, h.alpha, unclamped, record.place_of(h.id, s.at));
  }

  // The same in steps, for rays that meet a Gaussian together (trace/warp_walk.hpp).
  static constexpr int row_floats = 3 * sh_basis<ShDegree>::size;
  static constexpr bool records_hits = Record::any;
  GART_HD float const* rows_from() const { return sh; }
  GART_HD int row_floats_read() const { return 3 * sh_coefficients(active_degree); }
  GART_HD GART_INLINE vec3 shade(state const& s, float const* row) const {
    return s.basis.unclamped(*reinterpret_cast<float const(*)[row_floats]>(row));
  }
  GART_HD GART_INLINE bool add(state& s, float t, float alpha, vec3 const& unclamped, u32 place) const {
    vec3 const c = clamped_color(unclamped);
    [[maybe_unused]] vec3 const opaque = opaque_color(c, s.color, s.transmittance);
    float const weight = blend(alpha, t, c, s.color, s.depth, s.transmittance);
    record(place, opaque, weight, unclamped);
    ++s.hits;
    s.last = {t, place};
    return s.transmittance >= options.transmittance_min && s.hits != options.max_hits;
  }

  GART_HD void end(index_t, state const& s) const {
    std::size_t const a = order.address(s.at);
    if (out.color) {
      vec3 const c = s.color + s.transmittance * options.background;
      out.color[3 * a] = c.x, out.color[3 * a + 1] = c.y, out.color[3 * a + 2] = c.z;
    }
    if (out.transmittance) out.transmittance[a] = s.transmittance;
    if (out.depth) out.depth[a] = s.depth;
    if (out.hits) out.hits[a] = s.hits;
    if (out.last) out.last[a] = s.last;
  }
};

}  // namespace gart::inline GART_ISA
