#pragma once
/// \file
/// The scene as kernels hold it, in the frame of the rays. It has triangles with what stands at their corners,
/// materials, textures, lights and what lies around them.

#include <gart/bvh/triangle.hpp>
#include <gart/light/sampling.hpp>
#include <gart/light/scene.hpp>

namespace gart { inline namespace GART_ISA { namespace light_kernels {

using light::light_kind;
using light::material_kind;

// A mesh's triangle besides its corners.
struct triangle_row {
  vec3 normal[3];  // zero: the triangle's own
  vec2 uv[3];
  u32 material, mesh, number;  // places in the scene, and of the triangle in its mesh
};

struct material_row {
  material_kind kind;
  vec3 base_color, emission;
  float metallic, roughness, ior, opacity, cutout;
  int base_color_texture, metallic_roughness_texture, emission_texture, normal_texture;
};

struct texture_row {
  u64 offset;  // of its first texel
  int width, height;
  bool repeat_u, repeat_v;
};

struct light_row {
  light_kind kind;
  vec3 color, position, direction;  // color: of a disk in the sky its radiance
  float rise;                       // 1 - cosine of that disk's radius; 0: a point
  float radius;
  vec3 edge_u, edge_v, normal;
  float area;  // of a rectangle
};

struct environment_view {
  vec3 color{0.0f};
  int width = 0, height = 0;
  float const* texels = nullptr;   // [height][width][3]
  float const* rows = nullptr;     // [height + 1]: sums of what is above a row, the last is 1
  float const* columns = nullptr;  // [height][width + 1]: the same in a row
  mat3 to_image{1.0f};
  bool visible = true;  // to the camera

  // Image coordinates in [0, 1].
  GART_HD GART_INLINE vec2 place_of(vec3 const& direction) const {
    vec3 const d = to_image * direction;
    float const u = turns_of(-d.z, d.x) + 0.5f, across = square_root(d.x * d.x + d.z * d.z);
    return {u < 1.0f ? u : u - 1.0f, 2.0f * turns_of(d.y, across)};
  }
  GART_HD GART_INLINE vec3 texel(int x, int y) const {
    float const* const t = texels + 3 * (static_cast<std::size_t>(y) * width + x);
    return {t[0], t[1], t[2]};
  }
  GART_HD GART_INLINE vec3 radiance(vec3 const& direction) const {
    if (!texels) return color;
    vec2 const at = place_of(direction);
    float const x = at.x * static_cast<float>(width) - 0.5f,
                y = clamped(at.y * static_cast<float>(height) - 0.5f, 0.0f, static_cast<float>(height - 1));
    float const left = floorf(x), top = floorf(y);
    int const x0 = (static_cast<int>(left) + width) % width, x1 = (x0 + 1) % width, y0 = static_cast<int>(top),
              y1 = y0 + 1 < height ? y0 + 1 : y0;
    return color *
           mixed(mixed(texel(x0, y0), texel(x1, y0), x - left), mixed(texel(x0, y1), texel(x1, y1), x - left), y - top);
  }

  // Of the place: how likely sample() draws it, by solid angle.
  GART_HD GART_INLINE float density(vec2 const& at) const {
    int const y = static_cast<int>(clamped(at.y * static_cast<float>(height), 0.0f, static_cast<float>(height - 1))),
              x = static_cast<int>(clamped(at.x * static_cast<float>(width), 0.0f, static_cast<float>(width - 1)));
    float const* const row = columns + static_cast<std::size_t>(y) * (width + 1);
    float const part = (rows[y + 1] - rows[y]) * (row[x + 1] - row[x]), sine = turn_of(0.5f * at.y).y;
    return sine > 1e-6f ? part * static_cast<float>(width) * static_cast<float>(height) / (2.0f * pi * pi * sine)
                        : 0.0f;
  }
  // The last entry of [0, n) at or below u, and how far u is in it.
  GART_HD GART_INLINE static float found(float const* sums, int n, float u) {
    int lo = 0, hi = n;
    while (hi - lo > 1) {
      int const middle = (lo + hi) / 2;
      (sums[middle] <= u ? lo : hi) = middle;
    }
    float const size = sums[lo + 1] - sums[lo];
    return static_cast<float>(lo) + (size > 0 ? clamped((u - sums[lo]) / size, 0.0f, 0.999f) : 0.5f);
  }
  // By its brightness: a place, and its direction.
  GART_HD GART_INLINE vec3 sample(vec2 const& u, vec2& at) const {
    float const y = found(rows, height, u.x);
    float const x = found(columns + static_cast<std::size_t>(static_cast<int>(y)) * (width + 1), width, u.y);
    at = {x / static_cast<float>(width), y / static_cast<float>(height)};
    vec2 const down = turn_of(0.5f * at.y), around = turn_of(at.x < 0.5f ? at.x + 0.5f : at.x - 0.5f);
    return glm::transpose(to_image) * vec3(down.y * around.y, down.x, -down.y * around.x);
  }
};

// What a hit is of: a triangle, a light or nothing.
struct path_hit {
  static constexpr u32 is_light = 0x80000000u;
  float t = infinity;
  u32 id = triangle_hit::none;
  float u = 0, v = 0;
  GART_HD bool none() const { return id == triangle_hit::none; }
  GART_HD bool of_light() const { return !none() && (id & is_light); }
};

struct scene_view {
  triangles_view triangles;
  triangle_row const* rows = nullptr;
  material_row const* materials = nullptr;
  texture_row const* textures = nullptr;
  float const* texels = nullptr;  // [..][4]
  light_row const* lights = nullptr;
  u32 light_count = 0;
  environment_view around;
  vec2 const* specular = nullptr;  // light/surface.hpp

  GART_HD GART_INLINE vec4 texel(texture_row const& t, int x, int y) const {
    auto const wrapped = [](int at, int size, bool repeat) {
      if (repeat) return (at % size + size) % size;
      return at < 0 ? 0 : at < size ? at : size - 1;
    };
    float const* const from =
        texels +
        4 * (t.offset + static_cast<std::size_t>(wrapped(y, t.height, t.repeat_v)) * static_cast<std::size_t>(t.width) +
             static_cast<std::size_t>(wrapped(x, t.width, t.repeat_u)));
    return {from[0], from[1], from[2], from[3]};
  }
  // White where there is no texture.
  GART_HD GART_INLINE vec4 looked_up(int texture, vec2 const& uv) const {
    if (texture < 0) return vec4(1.0f);
    texture_row const t = textures[texture];
    // Far places repeat too; beyond what floats count, or of no number, the corner stands.
    auto const sane = [](float x) { return fabsf(x) < 1e6f ? x : 0.0f; };
    float const x = sane(uv.x * static_cast<float>(t.width) - 0.5f),
                y = sane(uv.y * static_cast<float>(t.height) - 0.5f), left = floorf(x), top = floorf(y);
    int const x0 = static_cast<int>(left), y0 = static_cast<int>(top);
    float const fx = x - left, fy = y - top;
    return (1.0f - fy) * ((1.0f - fx) * texel(t, x0, y0) + fx * texel(t, x0 + 1, y0)) +
           fy * ((1.0f - fx) * texel(t, x0, y0 + 1) + fx * texel(t, x0 + 1, y0 + 1));
  }
  GART_HD GART_INLINE static vec2 uv_of(triangle_row const& row, float u, float v) {
    return (1.0f - u - v) * row.uv[0] + u * row.uv[1] + v * row.uv[2];
  }
};

// Which triangles count: not where a material is cut out, and for shadows no catcher.
struct is_there {
  scene_view const& scene;
  bool shadows;
  GART_HD GART_INLINE bool operator()(triangle_hit const& h) const {
    u32 const number = scene.rows[h.id].material;
    material_row const& m = scene.materials[number];
    if (shadows && m.kind == material_kind::shadow_catcher) return false;
    if (!(m.cutout > 0)) return true;
    vec2 const uv = scene_view::uv_of(scene.rows[h.id], h.u, h.v);
    return m.opacity * scene.looked_up(m.base_color_texture, uv).w >= m.cutout;
  }
};

GART_HD GART_INLINE bool in_shadow(scene_view const& scene, vec3 const& from, vec3 const& direction, float far) {
  return meets_any_triangle(scene.triangles, ray{from, direction}, 0.0f, far, is_there{scene, true});
}

}}}  // namespace gart::GART_ISA::light_kernels
