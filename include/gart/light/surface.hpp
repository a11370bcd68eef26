#pragma once
/// \file
/// What a rough surface does with light, by glTF's metallic-roughness: a diffuse base under GGX. GGX has Smith's
/// height-correlated shadowing and Schlick's Fresnel. No light is lost. What one reflection in the microfacets leaves
/// out is given back (Turquin, "Practical multiple scattering compensation for microfacet models", 2019). The base gets
/// what the layer above it lets through. Reflections are drawn by visible normals (Dupuy and Benyoub, "Sampling visible
/// GGX normals with spherical caps", HPG 2023).

#include <gart/light/scene_view.hpp>

#include <vector>

namespace gart { inline namespace GART_ISA { namespace light_kernels {

// Directional albedos of GGX. With F = F0 + (rim - F0) Fc the albedo is F0 (x - y) + rim y. There x is the albedo where
// F is 1, and y that of Fc alone.
constexpr int specular_side = 32;  // roughness across, the root of the cosine down: it bends most where that is small

constexpr float least_alpha = 2e-3f;
GART_HD GART_INLINE float alpha_of(float roughness) { return fmaxf(roughness * roughness, least_alpha); }
GART_HD GART_INLINE float schlick(float cosine) {
  float const a = clamped(1.0f - cosine, 0.0f, 1.0f), a2 = a * a;
  return a2 * a2 * a;
}
// Smith's lambda of a direction about z.
GART_HD GART_INLINE float smith(vec3 const& w, float alpha) {
  float const z2 = w.z * w.z;
  return 0.5f * (square_root(1.0f + alpha * alpha * fmaxf(0.0f, 1.0f - z2) / z2) - 1.0f);
}
GART_HD GART_INLINE vec3 visible_normal(vec3 const& out, float alpha, vec2 const& u) {
  vec3 const stretched = unit(vec3(alpha * out.x, alpha * out.y, out.z));
  float const z = (1.0f - u.y) * (1.0f + stretched.z) - stretched.z,
              sine = square_root(clamped(1.0f - z * z, 0.0f, 1.0f));
  vec2 const turn = turn_of(u.x);
  vec3 const h = vec3(sine * turn.x, sine * turn.y, z) + stretched;
  return unit(vec3(alpha * h.x, alpha * h.y, fmaxf(h.z, 1e-6f)));
}

// All of a point's material that the directions do not decide, and those of the way back to the camera.
struct rough_surface {
  vec3 base, f0;  // of the diffuse layer and of the reflection
  float rim;      // of the reflection at a right angle; a surface that reflects nothing has none
  float alpha;
  vec3 gain;          // of the reflection, for what bounces on within the microfacets
  vec3 under;         // base, times what the reflection lets through
  float to_specular;  // how likely a direction is drawn by the reflection

  GART_HD rough_surface(vec3 const& color, float metallic, float roughness, float ior, float cosine,
                        vec2 const* table) {
    float const r = (ior - 1.0f) / (ior + 1.0f);
    base = color * (1.0f - metallic), f0 = mixed(vec3(r * r), color, metallic), alpha = alpha_of(roughness);
    rim = fminf(1.0f, 50.0f * largest(f0));
    vec2 const e = looked_up(table, roughness, cosine);
    gain = vec3(1.0f) + f0 * (1.0f / e.x - 1.0f);
    vec3 const reflected = (f0 * (e.x - e.y) + vec3(rim * e.y)) * gain;
    under = base * glm::max(vec3(0.0f), vec3(1.0f) - reflected);
    float const a = luminance(reflected), b = luminance(under);
    to_specular = !(a > 0) ? 0.0f : b > 0 ? clamped(a / (a + b), 0.1f, 0.9f) : 1.0f;
  }
  GART_HD static vec2 looked_up(vec2 const* table, float roughness, float cosine) {
    constexpr int most = specular_side - 2;
    float const x = clamped(roughness, 0.0f, 1.0f) * (specular_side - 1),
                y = square_root(clamped(cosine, 0.0f, 1.0f)) * (specular_side - 1);
    int const i = static_cast<int>(x) < most ? static_cast<int>(x) : most,
              j = static_cast<int>(y) < most ? static_cast<int>(y) : most;
    vec2 const *const top = table + j * specular_side + i, *const bottom = top + specular_side;
    float const fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
    return (1.0f - fy) * ((1.0f - fx) * top[0] + fx * top[1]) + fy * ((1.0f - fx) * bottom[0] + fx * bottom[1]);
  }

  // Of directions about z: what of the light is thrown back, times the cosine; and how likely draw() gives `in`.
  struct answer {
    vec3 thrown{0.0f};
    float density = 0;
  };
  GART_HD answer of(vec3 const& out, vec3 const& in) const {
    answer a;
    if (!(in.z > 0) || !(out.z > 0)) return a;
    vec3 const h = unit(out + in);
    float const facing = fmaxf(glm::dot(out, h), 0.0f), narrow = alpha * alpha;
    float const down = h.x * h.x + h.y * h.y + narrow * h.z * h.z;  // of D; no difference of almost equal numbers
    float const d = narrow / (pi * down * down), lo = smith(out, alpha), li = smith(in, alpha);
    float const by_facets = d / (4.0f * out.z);
    a.thrown = (f0 + (vec3(rim) - f0) * schlick(facing)) * gain * (by_facets / (1.0f + lo + li)) + under * (in.z / pi);
    a.density = to_specular * by_facets / (1.0f + lo) + (1.0f - to_specular) * in.z / pi;
    return a;
  }
  GART_HD vec3 draw(vec3 const& out, vec2 const& u, float which) const {
    if (which >= to_specular) return cosine_direction(u);
    vec3 const h = visible_normal(out, alpha, u);
    return 2.0f * glm::dot(out, h) * h - out;
  }
};

// The table's numbers, by a sum over visible normals. About 20 ms.
inline std::vector<vec2> sum_specular_albedos() {
  constexpr int steps = 32;
  std::vector<vec2> out;
  for (int j = 0; j < specular_side; ++j)
    for (int i = 0; i < specular_side; ++i) {
      float const root = static_cast<float>(j) / (specular_side - 1), cosine = fmaxf(root * root, 1e-3f);
      float const alpha = alpha_of(static_cast<float>(i) / (specular_side - 1));
      vec3 const w(square_root(1.0f - cosine * cosine), 0.0f, cosine);
      double all = 0, rim = 0;
      for (int a = 0; a < steps; ++a)
        for (int b = 0; b < steps; ++b) {
          vec3 const h = visible_normal(w, alpha,
                                        {(static_cast<float>(a) + 0.5f) / static_cast<float>(steps),
                                         (static_cast<float>(b) + 0.5f) / static_cast<float>(steps)});
          float const facing = glm::dot(w, h);
          vec3 const in = 2.0f * facing * h - w;
          if (!(in.z > 0)) continue;
          float const lo = smith(w, alpha), weight = (1.0f + lo) / (1.0f + lo + smith(in, alpha));
          all += weight, rim += weight * schlick(facing);
        }
      out.push_back({static_cast<float>(all / (steps * steps)), static_cast<float>(rim / (steps * steps))});
    }
  return out;
}

// The table, which a process computes once.
inline std::vector<vec2> const& specular_albedos() {
  static std::vector<vec2> const all = sum_specular_albedos();
  return all;
}

// Where a path meets a triangle.
struct surface_point {
  vec3 position, side, normal;  // the triangle's normal and that for shading, both against the ray
  float lift;                   // roundings of the position
  bool inside;                  // the ray came from behind
  material_kind kind;
  vec3 base, emission;
  float metallic, roughness, ior;

  GART_HD surface_point(scene_view const& scene, path_hit const& h, vec3 const& direction) {
    triangle const t = scene.triangles.triangles[h.id];
    triangle_row const row = scene.rows[h.id];
    material_row const m = scene.materials[row.material];
    float const first = 1.0f - h.u - h.v;
    position = first * t.corner[0] + h.u * t.corner[1] + h.v * t.corner[2];
    float reach = 0;
    for (vec3 const& c : t.corner) reach = fmaxf(reach, fmaxf(fabsf(c.x), fmaxf(fabsf(c.y), fabsf(c.z))));
    lift = 4e-6f * reach;
    side = unit(glm::cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]));
    vec2 const uv = scene_view::uv_of(row, h.u, h.v);
    normal = first * row.normal[0] + h.u * row.normal[1] + h.v * row.normal[2];
    float const length2 = glm::dot(normal, normal);
    normal = length2 > 1e-12f ? normal * reciprocal(square_root(length2)) : side;
    if (m.normal_texture >= 0) bend(scene.looked_up(m.normal_texture, uv), t, row);
    inside = glm::dot(side, direction) > 0;
    if (inside) side = -side, normal = -normal;
    if (!(glm::dot(normal, direction) < 0)) normal = side;  // seen past the horizon of the one for shading
    vec4 const color = scene.looked_up(m.base_color_texture, uv),
               rough = scene.looked_up(m.metallic_roughness_texture, uv),
               glow = scene.looked_up(m.emission_texture, uv);
    kind = m.kind, ior = m.ior;
    base = m.base_color * vec3(color.x, color.y, color.z), emission = m.emission * vec3(glow.x, glow.y, glow.z);
    metallic = m.metallic * rough.z, roughness = m.roughness * rough.y;
  }
  // Where a new ray in that direction begins: on its line, past the roundings of where the surface is.
  GART_HD GART_INLINE vec3 leave(vec3 const& direction) const {
    return position + (lift / fmaxf(fabsf(glm::dot(side, direction)), 0.05f)) * direction;
  }

 private:
  GART_HD void bend(vec4 const& texel, triangle const& t, triangle_row const& row) {
    vec3 const e = t.corner[1] - t.corner[0], f = t.corner[2] - t.corner[0];
    vec2 const a = row.uv[1] - row.uv[0], b = row.uv[2] - row.uv[0];
    float const det = a.x * b.y - b.x * a.y;
    if (!(fabsf(det) > 1e-20f)) return;
    vec3 along = (b.y * e - a.y * f) / det;  // where u grows
    along -= normal * glm::dot(normal, along);
    float const length2 = glm::dot(along, along);
    if (!(length2 > 1e-20f)) return;
    along = along * reciprocal(square_root(length2));
    // v goes down the image, y of the texel up; mirrored images have the other hand.
    vec3 const up = glm::cross(normal, along) * (det < 0 ? 1.0f : -1.0f);
    vec3 const bent = (2.0f * texel.x - 1.0f) * along + (2.0f * texel.y - 1.0f) * up + (2.0f * texel.z - 1.0f) * normal;
    float const size2 = glm::dot(bent, bent);
    if (size2 > 1e-12f) normal = bent * reciprocal(square_root(size2));
  }
};

}}}  // namespace gart::GART_ISA::light_kernels
