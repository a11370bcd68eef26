#pragma once
/// \file
/// Lights as a path meets them: what one gives to a point, drawn over its size. Also what a ray that runs into one
/// sees. Disks in the sky and spheres are drawn over their cone, rectangles over their area. Point lights and disks
/// without a size are one direction.

#include <gart/light/scene_view.hpp>

namespace gart { inline namespace GART_ISA { namespace light_kernels {

// What a point is given from one direction.
struct given_light {
  vec3 direction{0.0f};  // to the light
  float far = infinity;  // where it is
  vec3 radiance{0.0f};   // over the density; of one direction the irradiance across it
  float density = 0;     // by solid angle; 0: one direction
  GART_HD bool any() const { return luminance(radiance) > 0; }
};

// Of a sphere that is seen from a point: 1 - cosine of its radius; 0 from within.
GART_HD GART_INLINE float sphere_rise(light_row const& l, vec3 const& from) {
  vec3 const way = l.position - from;
  float const d2 = glm::dot(way, way), r2 = l.radius * l.radius;
  if (!(d2 > r2)) return 0;
  float const sine2 = r2 / d2;
  return sine2 / (1.0f + square_root(1.0f - sine2));
}

// Where a ray from a point meets a sphere's near side; infinity where it does not.
GART_HD GART_INLINE float sphere_distance(light_row const& l, ray const& r) {
  vec3 const way = l.position - r.origin;
  float const along = glm::dot(way, r.direction);
  vec3 const off = way - along * r.direction;
  float const rest = l.radius * l.radius - glm::dot(off, off);
  if (!(rest >= 0)) return infinity;
  float const t = along - square_root(rest);
  return t > 0 ? t : infinity;
}

GART_HD GART_INLINE float rectangle_distance(light_row const& l, ray const& r) {
  float const slope = glm::dot(l.normal, r.direction);
  if (!(slope < 0)) return infinity;
  float const t = glm::dot(l.normal, l.position - r.origin) / slope;
  vec3 const at = r.origin + t * r.direction - l.position;
  bool const inside = fabsf(glm::dot(at, l.edge_u)) <= 0.5f * glm::dot(l.edge_u, l.edge_u) &&
                      fabsf(glm::dot(at, l.edge_v)) <= 0.5f * glm::dot(l.edge_v, l.edge_v);
  return inside && t > 0 ? t : infinity;
}

// Lights that a ray can run into.
GART_HD GART_INLINE float light_distance(light_row const& l, ray const& r) {
  if (l.kind == light_kind::sphere) return sphere_distance(l, r);
  if (l.kind == light_kind::rectangle) return rectangle_distance(l, r);
  return infinity;
}

// How likely give() draws the direction in which a ray met the light at t.
GART_HD GART_INLINE float light_density(light_row const& l, ray const& r, float t) {
  if (l.kind == light_kind::rectangle) return t * t / (l.area * -glm::dot(l.normal, r.direction));
  float const rise = l.kind == light_kind::sphere ? sphere_rise(l, r.origin) : l.rise;
  return rise > 0 ? 1.0f / (2.0f * pi * rise) : 0.0f;
}

GART_HD GART_INLINE bool in_sky(light_row const& l, vec3 const& direction) {
  if (l.kind != light_kind::directional || !(l.rise > 0)) return false;
  vec3 const off = direction + l.direction;  // |off|^2 / 2 is 1 - cosine
  return 0.5f * glm::dot(off, off) <= l.rise;
}

GART_HD GART_INLINE given_light give(light_row const& l, vec3 const& to, vec2 const& u) {
  given_light out;
  switch (l.kind) {
    case light_kind::point: {
      vec3 const way = l.position - to;
      float const d2 = glm::dot(way, way), d = square_root(d2);
      if (!(d > 0)) return out;
      out.direction = way / d, out.far = d, out.radiance = l.color / d2;
      return out;
    }
    case light_kind::directional: {
      if (!(l.rise > 0)) {
        out.direction = -l.direction, out.radiance = l.color;
        return out;
      }
      out.direction = unit(axes(-l.direction).to_world(cone_direction(u, l.rise)));
      out.density = 1.0f / (2.0f * pi * l.rise), out.radiance = l.color / out.density;
      return out;
    }
    case light_kind::sphere: {
      float const rise = sphere_rise(l, to);
      if (!(rise > 0)) return out;
      out.direction = unit(axes(unit(l.position - to)).to_world(cone_direction(u, rise)));
      float const t = sphere_distance(l, {to, out.direction}), along = glm::dot(l.position - to, out.direction);
      out.far = 0.9999f * (t < infinity ? t : along);  // past its rim by a rounding
      out.density = 1.0f / (2.0f * pi * rise), out.radiance = l.color / out.density;
      return out;
    }
    case light_kind::rectangle: {
      vec3 const way = l.position + (u.x - 0.5f) * l.edge_u + (u.y - 0.5f) * l.edge_v - to;
      float const d2 = glm::dot(way, way), d = square_root(d2), facing = -glm::dot(l.normal, way);
      if (!(facing > 0)) return out;
      out.direction = way / d, out.far = 0.9999f * d;
      out.density = d2 * d / (l.area * facing), out.radiance = l.color / out.density;
      return out;
    }
  }
  return out;
}

// Light that falls on all sides of a point: by what a Gaussian or a catcher is lit. Random where a light has a size.
// `facing`: a surface's normal, either way; zero where there is none.
struct lit_share {
  vec3 all{0.0f}, unshadowed{0.0f};
};
GART_HD GART_INLINE lit_share lit_at(scene_view const& scene, vec3 const& point, vec3 const& facing, draws const& draw,
                                     u32 step) {
  lit_share out;
  bool const has_side = glm::dot(facing, facing) > 0;
  for (u32 l = 0; l < scene.light_count; ++l) {
    given_light g = give(scene.lights[l], point, draw.pair(step, draw_light + l));
    if (!g.any()) continue;
    if (has_side) g.radiance *= fabsf(glm::dot(facing, g.direction));
    out.all += g.radiance;
    if (!in_shadow(scene, point, g.direction, g.far)) out.unshadowed += g.radiance;
  }
  return out;
}

// What is left of a captured colour where some of the lights are shadowed. For an albedo it is the light itself.
struct shadow_rule {
  float ambient = 0.3f;
  bool relight = false;
  GART_HD GART_INLINE vec3 of(lit_share const& lit) const {
    vec3 const left = ambient * lit.all + (1.0f - ambient) * lit.unshadowed;
    if (relight) return left / pi;
    vec3 out(1.0f);
    for (int k = 0; k < 3; ++k)
      if (lit.all[k] > 0) out[k] = left[k] / lit.all[k];
    return out;
  }
};

}}}  // namespace gart::GART_ISA::light_kernels
