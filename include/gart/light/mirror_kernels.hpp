#pragma once
/// \file
/// What views with mirrors (light/mirror_paths.hpp) do to pixels and segments. An index is a pixel that is traced.

#include <gart/light/path_kernels.hpp>

namespace gart { inline namespace GART_ISA { namespace light_kernels {

// The rays of a segment, and what lies at its end; the path goes on where that is a mirror.
struct follow_mirrors {
  scene_view scene;
  path* paths;
  path_hit const* ends;
  vec3 background;
  float near;
  float *origins, *directions, *t_max;
  vec3 *share, *behind;  // the mirror's colour, zero where there is none; what shines at the end
  bool last;
  GART_KERNEL void operator()(index_t i) const {
    path p = paths[i];
    std::size_t const at = std::size_t{3} * i;
    path_hit const end = ends[i];
    bool const alive = p.is(path::alive);
    vec3 const direction = alive ? p.direction : vec3(0.0f, 0.0f, 1.0f);
    for (int k = 0; k < 3; ++k) {
      origins[at + static_cast<std::size_t>(k)] = p.origin[k];
      directions[at + static_cast<std::size_t>(k)] = direction[k];
    }
    // A ray that has ended is as short as one may be.
    t_max[i] = fmaxf(alive ? end.t : 0.0f, 2.0f * near);
    share[i] = vec3(0.0f), behind[i] = vec3(0.0f);
    if (!alive) return;
    p.flags = 0;
    if (end.none()) {
      behind[i] = scene.around.visible ? scene.around.radiance(p.direction) : background;
    } else if (end.of_light()) {
      behind[i] = scene.lights[end.id & ~path_hit::is_light].color;
    } else {
      surface_point const s(scene, end, p.direction);
      behind[i] = s.emission;
      if (s.kind == material_kind::mirror && !last) {
        share[i] = s.base;
        p.direction = reflected(p.direction, s.normal);
        p.origin = s.leave(p.direction), p.near = 0, p.flags = path::alive;
      }
    }
    paths[i] = p;
  }
};

// Shadow rays as a batch, and what each brings where nothing is in between.
struct batch_shadows {
  shadow_ray const* rays;
  float near;
  float *origins, *directions, *t_max;
  vec3* radiance;
  GART_KERNEL void operator()(index_t i) const {
    shadow_ray const r = rays[i];
    bool const any = r.far > 0;
    vec3 const direction = any ? r.direction : vec3(0.0f, 0.0f, 1.0f);
    for (int k = 0; k < 3; ++k) {
      origins[std::size_t{3} * i + static_cast<std::size_t>(k)] = any ? r.origin[k] : 0.0f;
      directions[std::size_t{3} * i + static_cast<std::size_t>(k)] = direction[k];
    }
    t_max[i] = fmaxf(r.far, 2.0f * near);
    radiance[i] = any ? r.radiance : vec3(0.0f);
  }
};
struct add_light {
  float const* transmittance;
  vec3 const* radiance;
  vec3* behind;
  GART_KERNEL void operator()(index_t i) const { behind[i] += transmittance[i] * radiance[i]; }
};
// From the gradient by what a segment sees to that by what a shadow ray lets through.
struct light_gradient {
  vec3 const *by_seen, *radiance;
  float const* transmittance;  // of the segment
  float* by_transmittance;
  GART_KERNEL void operator()(index_t i) const {
    by_transmittance[i] = transmittance[i] * glm::dot(by_seen[i], radiance[i]);
  }
};

// The coefficients of Gaussians in shadow: factor * (1/2 + sum of basis * sh) is again such a sum. And the way back.
struct shade_coefficients {
  float const* sh;
  vec3 const* factors;
  int coefficients;
  bool first_band;  // the others count nothing
  float* shaded;
  GART_KERNEL void operator()(index_t i) const {
    vec3 const f = factors[i];
    std::size_t const row = static_cast<std::size_t>(3 * coefficients) * i;
    for (int k = 0; k < 3 * coefficients; ++k) {
      std::size_t const at = row + static_cast<std::size_t>(k);
      shaded[at] = k < 3        ? f[k] * sh[at] + (f[k] - 1.0f) * (0.5f / static_cast<float>(sh_constant))
                   : first_band ? 0.0f
                                : f[k % 3] * sh[at];
    }
  }
};
struct unshade_gradient {
  vec3 const* factors;
  int coefficients;
  bool first_band;
  float* by_sh;
  GART_KERNEL void operator()(index_t i) const {
    std::size_t const row = static_cast<std::size_t>(3 * coefficients) * i;
    for (int k = 0; k < 3 * coefficients; ++k)
      by_sh[row + static_cast<std::size_t>(k)] *= k >= 3 && first_band ? 0.0f : factors[i][k % 3];
  }
};

// What a segment sees, from the last one to the first; `behind` becomes all that comes from its end.
struct blend_segment {
  float const *color, *transmittance;
  vec3 const *share, *beyond;  // beyond: null behind the last
  vec3 *behind, *seen;
  GART_KERNEL void operator()(index_t i) const {
    if (beyond) behind[i] += share[i] * beyond[i];
    float const* const c = color + std::size_t{3} * i;
    seen[i] = vec3(c[0], c[1], c[2]) + transmittance[i] * behind[i];
  }
};

// From the gradient by what a segment sees, which becomes that of the next.
struct split_gradient {
  float const* transmittance;
  vec3 const *share, *behind;
  vec3* by_seen;
  float *by_color, *by_transmittance;
  GART_KERNEL void operator()(index_t i) const {
    vec3 const g = by_seen[i];
    for (int k = 0; k < 3; ++k) by_color[std::size_t{3} * i + static_cast<std::size_t>(k)] = g[k];
    by_transmittance[i] = glm::dot(g, behind[i]);
    by_seen[i] = g * share[i] * transmittance[i];
  }
};

// Pixels that are traced: all, or those that meet a mirror first; a place for each.
struct find_mirrors {
  scene_view scene;
  path const* paths;
  path_hit const* ends;
  bool all;
  u32* traced;
  GART_KERNEL void operator()(index_t i) const {
    path_hit const end = ends[i];
    bool const surface = !end.none() && !end.of_light();
    traced[i] = paths[i].pixel != path::no_pixel &&
                (all || (surface && scene.materials[scene.rows[end.id].material].kind == material_kind::mirror));
  }
};
struct take_pixels {
  path const* all_paths;
  path_hit const* all_ends;
  u32 const *traced, *places;
  path* paths;
  path_hit* ends;
  u32* pixels;
  GART_KERNEL void operator()(index_t i) const {
    if (!traced[i]) return;
    paths[places[i]] = all_paths[i], ends[places[i]] = all_ends[i], pixels[places[i]] = all_paths[i].pixel;
  }
};
struct put_pixels {
  u32 const* pixels;
  vec3 const* from;
  float* to;
  GART_KERNEL void operator()(index_t i) const {
    for (int k = 0; k < 3; ++k) to[std::size_t{3} * pixels[i] + static_cast<std::size_t>(k)] = from[i][k];
  }
};
struct clear_pixels {
  u32 const* pixels;
  std::size_t channels;
  float* to;
  GART_KERNEL void operator()(index_t i) const {
    for (std::size_t k = 0; k < channels; ++k) to[channels * pixels[i] + k] = 0;
  }
};
struct get_pixels {
  u32 const* pixels;
  float const* from;
  vec3* to;
  GART_KERNEL void operator()(index_t i) const {
    float const* const c = from + std::size_t{3} * pixels[i];
    to[i] = {c[0], c[1], c[2]};
  }
};

struct add_floats {
  float const* from;
  float* to;
  GART_KERNEL void operator()(index_t i) const { to[i] += from[i]; }
};

}}}  // namespace gart::GART_ISA::light_kernels
