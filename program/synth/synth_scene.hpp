#pragma once
// The scene of `gart synth`: triangle meshes made by formula, with procedural colours. A capture so needs no other
// file, and its true scene has no Gaussians. A still life on a disc: a glazed vase with thin leaves, and a torus knot.
// Beside them a rounded box with a wire coil, and a copper ball in thin brass rings. Units are those of NeRF-Synthetic:
// everything lies within 1.3 of the origin, z up.

#include <gart/core/names.hpp>
#include <gart/core/types.hpp>
#include <gart/math/glm.hpp>

#include <vector>

namespace gart_cli {

using gart::u32;
using gart::u64;
using gart::vec2;
using gart::vec3;

// Diffuse under a GGX lobe: f0 is the reflectance at normal incidence (0: diffuse alone), `metal` has no diffuse part.
struct synth_material {
  vec3 (*albedo)(vec3 position, vec2 uv);
  float f0 = 0;
  float roughness = 0.5f;  // GGX alpha
  bool metal = false;      // then the albedo is the reflectance
  bool mirror = false;     // reflects all, and is nothing else
};

struct synth_mesh {
  std::vector<vec3> position{}, normal{};  // a vertex each
  std::vector<vec2> uv{};
  std::vector<u32> index{};  // three a triangle
  synth_material material;
  float point_density = 1;  // relative number of starting points per area
};

using synth_scene = std::vector<synth_mesh>;

// A mirror in the scene: upright at the disc's edge, or a ball in place of the copper one.
enum class synth_mirror { none, plane, ball };
constexpr auto names_of(synth_mirror) {
  using enum synth_mirror;
  return std::array<gart::name_of<synth_mirror>, 3>{{{none, "none"}, {plane, "plane"}, {ball, "ball"}}};
}
inline constexpr vec3 ball_center{0.42f, 0.42f, 0.0f};
inline constexpr float ball_radius = 0.42f;

// The seed places the leaves. About 60,000 triangles. A mirror is the last mesh.
synth_scene make_synth_scene(u64 seed, synth_mirror mirror = synth_mirror::none);

}  // namespace gart_cli
