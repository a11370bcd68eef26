#pragma once
/// \file
/// What is done to paths between their segments. They are cast from the camera, ended at a triangle or a light, lit,
/// and sent on. An index is a path.

#include <gart/camera/models.hpp>
#include <gart/light/path_options.hpp>
#include <gart/light/paths.hpp>
#include <gart/light/surface.hpp>

namespace gart { inline namespace GART_ISA { namespace light_kernels {

// The lens, where it is no point: the plane, or for cameras without one the sphere, that is sharp.
struct thin_lens {
  float radius = 0, focus = 1;
  bool flat = true;
  mat3 rotation{1.0f};
  vec3 moved{0.0f};  // from where the frame is
};

template <camera_model M>
struct cast_paths {
  M model;
  pixel_order order;
  thin_lens lens;
  float near;
  vec3 background;
  u64 seed;
  u32 sample;
  bool jitter;
  path* paths;
  GART_KERNEL void operator()(index_t i) const {
    pixel const of = order.at(i);
    if (!order.inside(of)) {
      paths[i] = {vec3(0.0f), near, vec3(0.0f), 0, vec3(0.0f), 0, vec3(0.0f), path::no_pixel};
      return;
    }
    u32 const place = static_cast<u32>(order.address(of));
    draws const draw = draws::of(seed, place, sample);
    vec2 const at = jitter ? draw.pair(0, draw_pixel) : vec2(0.5f);
    auto const cast = model.ray(static_cast<float>(of.x) + at.x, static_cast<float>(of.y) + at.y);
    path p{origin_of(cast), near, cast.direction, 0, vec3(1.0f), path::alive | path::specular | path::direct,
           vec3(0.0f),      place};
    p.origin += lens.moved;
    if (p.direction == vec3(0.0f)) {  // a pixel that no ray is of
      p.flags = 0, p.radiance = background;
    } else if (lens.radius > 0) {
      vec2 const on = lens.radius * in_disk(draw.pair(0, draw_lens));
      float const along = lens.flat ? glm::dot(p.direction, lens.rotation[2]) : 1.0f;
      vec3 const sharp = p.origin + (lens.focus / along) * p.direction;
      p.origin += on.x * lens.rotation[0] + on.y * lens.rotation[1];
      p.direction = unit_ray<float>(sharp - p.origin).direction;
    }
    paths[i] = p;
  }
};

struct end_segments {
  scene_view scene;
  path const* paths;
  path_hit* ends;
  GART_KERNEL void operator()(index_t i) const {
    path const p = paths[i];
    path_hit end;
    if (p.is(path::alive)) {
      triangle_hit const t = nearest_triangle(scene.triangles, p.own(), p.near, infinity, is_there{scene, false});
      end = {t.t, t.id, t.u, t.v};
      for (u32 l = 0; l < scene.light_count; ++l) {
        float const at = light_distance(scene.lights[l], p.own());
        if (at > p.near && at < end.t) end = {at, path_hit::is_light | l, 0, 0};
      }
    }
    ends[i] = end;
  }
};

GART_HD GART_INLINE vec3 bounded(vec3 const& c, float most, u32 bounces) {
  float const top = largest(c);
  return most > 0 && bounces > 0 && top > most ? c * (most / top) : c;
}

// A shadow ray from the surface that each path has come to, to one of the lights. The last light is what lies around.
// Alone: no path goes on from a surface to meet a light by chance.
struct aim_at_light {
  scene_view scene;
  path const* paths;
  path_hit const* ends;
  shadow_ray* rays;
  u32 light;
  u32 bounces;
  float firefly;
  u64 seed;
  u32 sample, step;
  bool alone = false;
  GART_KERNEL void operator()(index_t i) const {
    rays[i].far = 0;
    path const p = paths[i];
    path_hit const end = ends[i];
    if (!p.is(path::alive) || p.is(path::opaque) || end.none() || end.of_light() || p.bounces() >= bounces) return;
    surface_point const s(scene, end, p.direction);
    if (s.kind != material_kind::surface) return;
    draws const draw = draws::of(seed, p.pixel, sample);
    given_light const g = light < scene.light_count
                              ? give(scene.lights[light], s.position, draw.pair(step, draw_light + light))
                              : from_around(draw.pair(step, draw_environment));
    if (!g.any() || !(glm::dot(s.side, g.direction) > 0)) return;
    axes const about(s.normal);
    vec3 const out = about.to_local(-p.direction);
    rough_surface const m(s.base, s.metallic, s.roughness, s.ior, out.z, scene.specular);
    auto const a = m.of(out, about.to_local(g.direction));
    float const share = g.density > 0 && !alone ? balance(g.density, a.density) : 1.0f;
    vec3 const radiance = bounded(p.throughput * a.thrown * g.radiance * share, firefly, p.bounces());
    if (!(luminance(radiance) > 0)) return;
    vec3 const origin = s.leave(g.direction);
    if (in_shadow(scene, origin, g.direction, g.far)) return;
    rays[i] = {origin, g.far, g.direction, 0, radiance, 0};
  }

 private:
  GART_HD given_light from_around(vec2 const& u) const {
    given_light g;
    vec2 at;
    g.direction = unit(scene.around.sample(u, at));
    g.density = scene.around.density(at);
    if (g.density > 0) g.radiance = scene.around.radiance(g.direction) / g.density;
    return g;
  }
};

// At the end of a segment: what shines is added, and a surface sends the path on.
struct send_on {
  scene_view scene;
  path* paths;
  path_hit const* ends;
  vec3 background;
  u32 bounces, roulette_after;
  float firefly;
  shadow_rule rule;
  u64 seed;
  u32 sample, step;

  GART_KERNEL void operator()(index_t i) const {
    path p = paths[i];
    if (!p.is(path::alive)) return;
    path_hit const end = ends[i];
    bool goes_on = false;
    if (end.none())
      add(p, beyond(p));
    else if (p.is(path::opaque))
      ;
    else if (end.of_light()) {
      light_row const& l = scene.lights[end.id & ~path_hit::is_light];
      add(p, l.color * (p.is(path::specular) ? 1.0f : balance(p.density, light_density(l, p.own(), end.t))));
    } else {
      goes_on = at_surface(p, end, draws::of(seed, p.pixel, sample));
    }
    if (!goes_on) p.flags &= ~path::alive;
    paths[i] = p;
  }

 private:
  GART_HD void add(path& p, vec3 const& seen) const {
    p.radiance += bounded(p.throughput * seen, firefly, p.bounces());
  }
  // The camera sees no disk in the sky itself: photographs have theirs.
  GART_HD vec3 beyond(path const& p) const {
    environment_view const& e = scene.around;
    if (p.is(path::direct) && !e.visible) return background;
    vec3 seen = e.radiance(p.direction);
    if (e.texels && !p.is(path::specular)) seen *= balance(p.density, e.density(e.place_of(p.direction)));
    if (p.bounces() == 0) return seen;
    for (u32 l = 0; l < scene.light_count; ++l) {
      light_row const& s = scene.lights[l];
      if (in_sky(s, p.direction))
        seen += s.color * (p.is(path::specular) ? 1.0f : balance(p.density, light_density(s, p.own(), 0)));
    }
    return seen;
  }
  GART_HD bool at_surface(path& p, path_hit const& end, draws const& draw) const {
    surface_point const s(scene, end, p.direction);
    if (s.kind == material_kind::shadow_catcher) {
      p.throughput *= rule.of(lit_at(scene, s.position + s.lift * s.side, s.normal, draw, step));
      p.near = end.t;
      return true;
    }
    add(p, s.emission);
    if (p.bounces() >= bounces) return false;
    vec2 const lobe = draw.pair(step, draw_lobe);
    if (s.kind == material_kind::mirror) {
      p.throughput *= s.base;
      p.direction = thrown_back(p.direction, s);
    } else if (s.kind == material_kind::dielectric) {
      float const ratio = s.inside ? s.ior : 1.0f / s.ior;
      if (lobe.x < fresnel(-glm::dot(p.direction, s.normal), ratio)) {
        p.direction = thrown_back(p.direction, s);
      } else {
        vec3 const through = refracted(p.direction, s.normal, ratio);
        if (!(glm::dot(through, s.side) < 0)) return false;
        p.throughput *= s.base, p.direction = through;
      }
    } else {
      axes const about(s.normal);
      vec3 const out = about.to_local(-p.direction);
      rough_surface const m(s.base, s.metallic, s.roughness, s.ior, out.z, scene.specular);
      vec3 const in = m.draw(out, draw.pair(step, draw_direction), lobe.x), direction = unit(about.to_world(in));
      auto const a = m.of(out, in);
      if (!(a.density > 0) || !(glm::dot(direction, s.side) > 0)) return false;
      p.throughput *= a.thrown / a.density;
      p.direction = direction, p.density = a.density;
      p.flags &= ~(path::specular | path::direct);
    }
    if (s.kind != material_kind::surface) p.flags |= path::specular;
    p.flags += path::bounce;
    p.origin = s.leave(p.direction), p.near = 0;
    if (p.bounces() <= roulette_after) return largest(p.throughput) > 0;
    float const stays = clamped(largest(p.throughput), 0.05f, 1.0f);
    p.throughput /= stays;
    return lobe.y < stays;
  }
  // Not into the surface, where the normal for shading leans.
  GART_HD static vec3 thrown_back(vec3 const& direction, surface_point const& s) {
    vec3 const out = reflected(direction, s.normal);
    return glm::dot(out, s.side) > 0 ? out : reflected(direction, s.side);
  }
};

struct add_samples {
  path const* paths;
  float* sums;  // [P][3]
  GART_KERNEL void operator()(index_t i) const {
    vec3 const c = paths[i].radiance;
    if (paths[i].pixel == path::no_pixel) return;
    if (!(is_finite(c.x) && is_finite(c.y) && is_finite(c.z))) return;
    for (int k = 0; k < 3; ++k) sums[std::size_t{3} * paths[i].pixel + static_cast<std::size_t>(k)] += c[k];
  }
};

// From sums of samples to their mean, exposed and in a tone. An index is a number of a colour.
struct show_samples {
  float const* sums;
  float share, gain;  // one over the samples; of the exposure
  light::tone_kind tone;
  float* to;
  GART_KERNEL void operator()(index_t i) const {
    using enum light::tone_kind;
    float x = sums[i] * share * gain;
    if (tone == filmic) x = rolled_off(x);
    to[i] = tone == none ? x : displayed(clamped(x, 0.0f, 1.0f));
  }

 private:
  // Narkowicz, "ACES filmic tone mapping curve", 2015.
  GART_HD static float rolled_off(float x) {
    x = fmaxf(x, 0.0f);
    return x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f);
  }
};

// How far each Gaussian is in the shadow of meshes, at its centre.
struct shade_gaussians {
  scene_view scene;
  float const* means;  // [N][3], world
  vec3d frame;
  shadow_rule rule;
  u64 seed;
  u32 samples;
  vec3* factors;
  GART_KERNEL void operator()(index_t i) const {
    float const* const m = means + std::size_t{3} * i;
    vec3 const at = relative_mean({m[0], m[1], m[2]}, frame);
    vec3 sum(0.0f);
    for (u32 s = 0; s < samples; ++s) sum += rule.of(lit_at(scene, at, vec3(0.0f), draws::of(seed, i, s), 0));
    factors[i] = sum / static_cast<float>(samples);
  }
};

// The surface's part of the layers, behind the Gaussians'.
struct add_surface_layers {
  scene_view scene;
  path const* paths;
  path_hit const* ends;
  layer_targets out;
  GART_KERNEL void operator()(index_t i) const {
    u32 const at = paths[i].pixel;
    if (at == path::no_pixel) return;
    out.mesh[at] = out.triangle[at] = triangle_hit::none;
    float* const normal = out.normal + std::size_t{3} * at;
    float* const albedo = out.albedo + std::size_t{3} * at;
    normal[0] = normal[1] = normal[2] = 0;
    path_hit const end = ends[i];
    if (!paths[i].is(path::alive) || end.none() || end.of_light()) return;
    surface_point const s(scene, end, paths[i].direction);
    float const left = out.transmittance[at];
    for (int k = 0; k < 3; ++k) normal[k] = left * s.normal[k], albedo[k] += left * s.base[k];
    out.depth[at] += left * end.t;
    out.mesh[at] = scene.rows[end.id].mesh, out.triangle[at] = scene.rows[end.id].number;
  }
};

}}}  // namespace gart::GART_ISA::light_kernels
