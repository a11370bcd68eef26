#pragma once
/// \file
/// The forward ray program: front-to-back compositing of the hits of a pixel,
///   C += T alpha c,  T *= 1 - alpha,
/// colour from spherical harmonics on the ray's direction. A ray ends when T < transmittance_min (the hit that crosses
/// counts), or after max_hits where there is such a cap. The background is added with what transmittance is left. The
/// effect of a hit on a ray is a template over the number. So render/packet_composite.hpp applies it to a packet.

#include <gart/math/blend.hpp>
#include <gart/math/sh.hpp>
#include <gart/render/options.hpp>
#include <gart/render/record.hpp>
#include <gart/scene/gaussians.hpp>

#include <type_traits>

namespace gart { inline namespace GART_ISA {

/// The last hit of a ray; t = -1 where the ray has none. A place stands for an id: the places of a pixel's hits have
/// the order of their Gaussians.
struct last_hit {
  float t = -1;   ///< distance along the ray
  u32 place = 0;  ///< what the record calls it by
};

/// Row-major, one entry a pixel; null where not wanted.
struct image_targets {
  float* color = nullptr;          ///< [3], background composited
  float* transmittance = nullptr;  ///< after the last hit
  float* depth = nullptr;          ///< sum of weight * t
  u32* hits = nullptr;             ///< composited
  last_hit* last = nullptr;        ///< the hit that the ray ended with
};

/// The sums over the hits of a ray, or of a ray a lane (math/lanes.hpp).
template <class F>
struct composited_hits {
  using words = typename number<F>::words;      ///< whole numbers, one a ray
  vec3_of<F> color{F(0.0f), F(0.0f), F(0.0f)};  ///< colour so far, without the background
  F transmittance = 1.0f;                       ///< the light that the hits so far let through, 1 to 0
  F depth = 0.0f;                               ///< sum of weight * t
  words hits{};                                 ///< number of hits
  F last_t = last_hit{}.t;                      ///< t of the latest hit
  words last_place{};                           ///< place of the latest hit, as the record has it
};

/// The pixel program of the forward pass (trace/ray_program.hpp): composites each ray's hits and writes `out`.
template <int ShDegree, hit_record Record, rays_of_pixels Rays = pixel_rays>
struct composite : ray_program_base {
  static constexpr bool has_packets = Rays::central,  ///< it is walked in packets on a host
      has_warps = Rays::central;                      ///< and in warps on a device
  /// From the camera's centre, or from anywhere.
  using ray_type = typename Rays::ray_type;
  /// A ray on its way.
  struct state : composited_hits<float> {
    pixel at;                  ///< whose ray it is
    vec3 direction;            ///< of the ray, unit length
    sh_basis<ShDegree> basis;  ///< of that direction
  };

  Rays rays;                     ///< of the view
  pixel_order order;             ///< of the view
  float const* sh = nullptr;     ///< coefficients, [N][K][3], K of ShDegree
  int active_degree = ShDegree;  ///< bands above it are not evaluated
  render_options options;        ///< thresholds, cap and background
  image_targets out;             ///< where the pixels go
  Record record;                 ///< what a backward pass wants to find of each hit

  /// Whether ray i is of a pixel of the image.
  GART_HD bool active(index_t i) const { return order.inside(order.at(i)); }
  /// The pixel of ray i.
  GART_HD pixel at(index_t i) const { return order.at(i); }
  /// The state before the first hit.
  GART_HD state begin(index_t i) const {
    state s;
    s.at = order.at(i);
    s.direction = pixel_ray(rays, s.at).direction;
    s.basis = sh_basis<ShDegree>(s.direction);
    return s;
  }
  /// Ray i, in the view's frame.
  GART_HD ray_type ray_of(index_t, state const& s) const {
    if constexpr (Rays::central)
      return {s.direction};
    else
      return pixel_ray(rays, s.at);
  }
  /// Composites a hit. False: the ray ends.
  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const {
    constexpr std::size_t stride = row_floats;
    vec3 const unclamped = s.basis.unclamped(sh_row<ShDegree>(sh + stride * h.id, active_degree).v);
    return add(s, h.t, h.alpha, unclamped, record.place_of(h.id, s.at));
  }

  /// The same in steps, for rays that meet a Gaussian together (trace/warp_walk.hpp).
  static constexpr int row_floats = 3 * sh_basis<ShDegree>::size;
  static constexpr bool uses_slots = Record::any;  ///< hits are told apart by places
  using cell = typename Record::cell;              ///< finds them
  /// Where the rows of coefficients begin.
  GART_HD float const* rows_from() const { return sh; }
  /// Floats of a row that the active degree needs.
  GART_HD int row_floats_read() const { return 3 * sh_coefficients(active_degree); }
  /// The colour of a hit before the clamp, from its Gaussian's row.
  GART_HD GART_INLINE vec3 shade(state const& s, float const* row) const {
    return s.basis.unclamped(*reinterpret_cast<float const(*)[row_floats]>(row));
  }
  /// Composites a hit of this colour. False: the ray ends.
  GART_HD GART_INLINE bool add(state& s, float t, float alpha, vec3 const& unclamped, u32 place) const {
    return blend_hit(s, true, t, alpha, unclamped, place) && s.hits != options.max_hits;
  }

  /// A hit with the rays of a mask, or with the one ray there is. The record identifies the hit by `place`. The rays
  /// that let through enough to go on, whatever the cap.
  template <class F>
  GART_HD GART_INLINE auto blend_hit(composited_hits<F>& s, typename number<F>::mask now, F t, F alpha,
                                     vec3_of<F> const& unclamped, typename number<F>::words const& place) const {
    F const zero = 0.0f;
    vec3_of<F> const c = clamped_color(unclamped);
    [[maybe_unused]] vec3_of<F> const opaque = opaque_color(c, s.color, s.transmittance);
    [[maybe_unused]] F const depth = opaque_depth(t, s.depth, s.transmittance);
    // A hit without alpha does not change a ray.
    F const weight = blend(select(now, alpha, zero), select(now, t, zero), c, s.color, s.depth, s.transmittance);
    auto const note = [&](auto const&... where) {
      if constexpr (Record::depth)
        return record(where..., opaque, weight, unclamped, depth);
      else
        return record(where..., opaque, weight, unclamped);
    };
    if constexpr (std::is_same_v<F, float>)
      note(place);
    else
      note(place, now);
    s.hits += select(now, number<F>::every(1), number<F>::every(0));
    s.last_t = select(now, t, s.last_t), s.last_place = select(now, place, s.last_place);
    return s.transmittance >= F(options.transmittance_min);
  }

  /// Writes the pixel.
  GART_HD void end(index_t, state const& s) const { write(s.at, s); }

  /// Writes the sums over the hits, with the background, to the targets of pixel `at`.
  GART_HD void write(pixel at, composited_hits<float> const& s) const {
    std::size_t const a = order.address(at);
    if (out.color) {
      vec3 const c = s.color + s.transmittance * options.background;
      out.color[3 * a] = c.x, out.color[3 * a + 1] = c.y, out.color[3 * a + 2] = c.z;
    }
    if (out.transmittance) out.transmittance[a] = s.transmittance;
    if (out.depth) out.depth[a] = s.depth;
    if (out.hits) out.hits[a] = s.hits;
    if (out.last) out.last[a] = {s.last_t, s.last_place};
  }
};
static_assert(warp_program<composite<3, record_none>>);

}}  // namespace gart::GART_ISA
