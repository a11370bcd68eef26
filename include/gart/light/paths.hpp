#pragma once
/// \file
/// Paths on their way, one a pixel in the order of blocks (trace/pixel_order.hpp), and what Gaussians do to them. Here
/// are the ray programs of a segment, of a shadow ray and of a picture's layers.
///
/// A segment goes from where a path began or met a surface to the next surface. It takes the hits whose t lies in
/// (near, far]. A hit is where its Gaussian's response is largest along the ray. So a Gaussian that reaches through a
/// surface counts whole on one side of it. Its light is off by at most 1 - sqrt(1 - alpha) against density that is
/// spread along the ray. It is off most where the surface goes through its middle (tests/light/physics.cpp measures
/// it). A path that goes straight on keeps its origin. Its next segment begins where the last ended, with the same t to
/// the bit. So no hit is taken twice, and none is lost.

#include <gart/light/lights.hpp>
#include <gart/math/srgb.hpp>
#include <gart/rays/batch_composite.hpp>
#include <gart/rays/world_index.hpp>

namespace gart { inline namespace GART_ISA { namespace light_kernels {

struct alignas(16) path {
  static constexpr u32 alive = 1, specular = 2, direct = 4, opaque = 8, bounce = 0x100;
  static constexpr u32 no_pixel = 0xffffffffu;
  vec3 origin;
  float near;  // where its segment begins along the ray
  vec3 direction;
  float density;  // that the direction was drawn with; none where specular
  vec3 throughput;
  u32 flags;  // specular: the last surface had no choice; direct: none so far had; opaque: Gaussians let nothing
              // through
  vec3 radiance;
  u32 pixel;  // its place in an array [H][W]; none beyond the image

  GART_HD bool is(u32 flag) const { return (flags & flag) != 0; }
  GART_HD u32 bounces() const { return flags / bounce; }
  GART_HD ray own() const { return {origin, direction}; }
};
static_assert(sizeof(path) == 64);

struct alignas(16) shadow_ray {
  vec3 origin;
  float far;  // 0: there is none
  vec3 direction;
  float unused;
  vec3 radiance;  // that reaches the camera where nothing is in between
  float unused2;
};
static_assert(sizeof(shadow_ray) == 48);

GART_HD GART_INLINE vec3 decoded(vec3 const& c) { return {linear_light(c.x), linear_light(c.y), linear_light(c.z)}; }

// What colour a Gaussian has among the lights.
struct gaussian_colors {
  color_rows rows;
  vec3 const* factors = nullptr;  // [N]: per Gaussian; null where there are none
  bool albedo = false;            // of the first band in place of the colour
  bool linear = false;            // decoded from sRGB's curve

  GART_HD GART_INLINE vec3 own(sh_basis<color_rows::most> const& basis, u32 id) const {
    vec3 const c = clamped_color(albedo ? of_first_band(id) : rows.unclamped(basis, id));
    return linear ? decoded(c) : c;
  }
  GART_HD GART_INLINE vec3 of_first_band(u32 id) const {
    float const* const row = rows.sh + static_cast<std::size_t>(3 * sh_coefficients(rows.stored_degree)) * id;
    return vec3(0.5f) + static_cast<float>(sh_constant) * vec3(row[0], row[1], row[2]);
  }
};

// PerHit: shadows of each hit, where its ray meets it.
template <bool PerHit>
struct segment : ray_program_base {
  using ray_type = ray;
  struct state : composited_hits<float> {
    ray own;
    float far;
    sh_basis<color_rows::most> basis;
  };

  path* paths;
  path_hit const* ends;
  gaussian_colors colors;
  render_options options;
  scene_view scene;  // of PerHit
  shadow_rule rule;
  u64 seed;
  u32 sample, step;
  pixel_order order;  // of the paths

  GART_HD bool active(index_t i) const { return paths[i].is(path::alive); }
  GART_HD pixel at(index_t i) const { return order.at(i); }
  GART_HD float near(index_t i) const { return paths[i].near; }
  GART_HD float far(index_t i) const { return ends[i].t; }
  GART_HD state begin(index_t i) const {
    state s;
    s.own = paths[i].own(), s.far = ends[i].t;
    s.basis = sh_basis<color_rows::most>(s.own.direction);
    return s;
  }
  GART_HD ray ray_of(index_t, state const& s) const { return s.own; }
  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const {
    if (h.t > s.far) return false;
    vec3 c = colors.own(s.basis, h.id);
    if (colors.factors) c *= colors.factors[h.id];
    if constexpr (PerHit)
      c *= rule.of(lit_at(scene, s.own.origin + h.t * s.own.direction, vec3(0.0f),
                          draws::of(seed ^ h.id, float_to_bits(h.t), sample), step));
    blend(h.alpha, h.t, c, s.color, s.depth, s.transmittance);
    return s.transmittance >= options.transmittance_min && ++s.hits != options.max_hits;
  }
  GART_HD void end(index_t i, state const& s) const {
    path& p = paths[i];
    p.radiance += p.throughput * s.color;
    p.throughput *= s.transmittance;
    if (s.transmittance < options.transmittance_min) p.flags |= path::opaque;
  }
};

// What of a light comes through the Gaussians, added to the paths.
struct shadow_segment : ray_program_base {
  using ray_type = ray;
  struct state {
    ray own;
    float far;
    float transmittance = 1;
  };

  shadow_ray const* rays;
  path* paths;
  float transmittance_min;

  GART_HD bool active(index_t i) const { return rays[i].far > 0; }
  GART_HD float far(index_t i) const { return rays[i].far; }
  GART_HD state begin(index_t i) const { return {{rays[i].origin, rays[i].direction}, rays[i].far}; }
  GART_HD ray ray_of(index_t, state const& s) const { return s.own; }
  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const {
    if (h.t > s.far) return false;
    s.transmittance *= 1.0f - h.alpha;
    return s.transmittance >= transmittance_min;
  }
  GART_HD void end(index_t i, state const& s) const { paths[i].radiance += s.transmittance * rays[i].radiance; }
};

// Row-major, one entry a pixel.
struct layer_targets {
  float *albedo, *normal, *depth, *transmittance;
  u32 *gaussian, *mesh, *triangle;
};

// The layers of the paths' first segments.
struct layer_segment : ray_program_base {
  using ray_type = ray;
  struct state : composited_hits<float> {
    ray own;
    float far;
    float top_weight = 0;
    u32 top = no_gaussian;
  };

  path const* paths;
  path_hit const* ends;
  gaussian_colors colors;
  render_options options;
  layer_targets out;

  GART_HD bool active(index_t i) const { return paths[i].pixel != path::no_pixel; }
  GART_HD float near(index_t i) const { return paths[i].near; }
  GART_HD float far(index_t i) const { return paths[i].is(path::alive) ? ends[i].t : 0.0f; }
  GART_HD state begin(index_t i) const {
    state s;
    s.own = paths[i].own(), s.far = far(i);
    return s;
  }
  GART_HD ray ray_of(index_t, state const& s) const { return s.own; }
  GART_HD GART_INLINE bool on_hit(state& s, hit const& h) const {
    if (h.t > s.far) return false;
    vec3 const c = clamped_color(colors.of_first_band(h.id));
    float const weight = blend(h.alpha, h.t, colors.linear ? decoded(c) : c, s.color, s.depth, s.transmittance);
    if (weight > s.top_weight) s.top_weight = weight, s.top = h.id;
    return s.transmittance >= options.transmittance_min && ++s.hits != options.max_hits;
  }
  GART_HD void end(index_t i, state const& s) const {
    std::size_t const at = paths[i].pixel;
    for (int k = 0; k < 3; ++k) out.albedo[3 * at + static_cast<std::size_t>(k)] = s.color[k];
    out.depth[at] = s.depth, out.transmittance[at] = s.transmittance, out.gaussian[at] = s.top;
  }
};

}}}  // namespace gart::GART_ISA::light_kernels
