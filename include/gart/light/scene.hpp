#pragma once
/// \file
/// What stands among the Gaussians: meshes with their materials, lights, and what lies around them all. Host-safe and
/// plain: readers of files fill it in, make_path_renderer takes it.
///
/// All is in the world of the Gaussians, in its units and axes: readers bake poses into positions. Colours are linear
/// RGB. A number of a texture or a material is its place in the scene's list; -1 is none.
/// Errors: require_scene throws invalid_argument, naming the part, its name and the field.

#include <gart/core/names.hpp>
#include <gart/core/types.hpp>
#include <gart/math/glm.hpp>

#include <string>
#include <vector>

namespace gart::light {

/// An image on a surface. Looked up bilinearly; (0, 0) is the outer corner of the first texel, v goes down.
struct texture {
  std::string name;                       ///< for messages
  int width = 0, height = 0;              ///< texels
  std::vector<float> texels;              ///< [height][width][4], linear RGB and alpha
  bool repeat_u = true, repeat_v = true;  ///< else the border goes on
};

/// What a surface does with light.
enum class material_kind {
  surface,         ///< metallic-roughness, as glTF has it: a diffuse base under GGX
  mirror,          ///< reflects all, in its base colour
  dielectric,      ///< smooth glass: Snell, Fresnel, total reflection; base colour tints what goes through
  shadow_catcher,  ///< not seen itself: what lies behind is darkened where meshes shadow it; a path passes four at most
};
/// Their names.
constexpr auto names_of(material_kind) {
  using enum material_kind;
  return std::array<name_of<material_kind>, 4>{
      {{surface, "surface"}, {mirror, "mirror"}, {dielectric, "dielectric"}, {shadow_catcher, "shadow_catcher"}}};
}

/// Of triangles. Both sides of a triangle are the same, but for glass, whose inside is against the normal.
struct material {
  std::string name;                             ///< for messages
  material_kind kind = material_kind::surface;  ///< what it does
  vec3 base_color{0.8f};                        ///< [0, 1]; times its texture
  float metallic = 0, roughness = 1;            ///< [0, 1]; times the texture's blue and green
  float ior = 1.5f;                             ///< of glass, and of a surface's reflection; 1 or more
  vec3 emission{0.0f};                          ///< radiance; times its texture
  float opacity = 1;                            ///< [0, 1]; times the base colour texture's alpha; only a cutout asks
  float cutout = 0;                             ///< positive: opaque where the opacity reaches it, else not there
  int base_color_texture = -1, metallic_roughness_texture = -1, emission_texture = -1;  ///< places, or none
  int normal_texture = -1;  ///< in tangent space, x right, y up, each 2 c - 1; needs uvs
};

/// Triangles.
struct mesh {
  std::string name;                    ///< for messages
  std::vector<vec3> positions;         ///< [V], world
  std::vector<vec3> normals;           ///< [V], unit, for shading; empty: those of the triangles
  std::vector<vec2> uvs;               ///< [V]; empty: textures are read at (0, 0)
  std::vector<u32> triangles;          ///< [T][3], counter-clockwise seen from outside
  std::vector<u32> triangle_material;  ///< [T], places in scene.materials; empty: all are of the first
};

/// What shines.
enum class light_kind { point, directional, sphere, rectangle };
/// Their names.
constexpr auto names_of(light_kind) {
  using enum light_kind;
  return std::array<name_of<light_kind>, 4>{
      {{point, "point"}, {directional, "directional"}, {sphere, "sphere"}, {rectangle, "rectangle"}}};
}

/// A light. Spheres and rectangles are seen, by the camera and in mirrors.
struct light {
  std::string name;                     ///< for messages
  light_kind kind = light_kind::point;  ///< which of the fields below it has
  vec3 color{1.0f};                     ///< point: radiant intensity. directional: irradiance across it. Else: radiance
  vec3 position{0.0f};                  ///< point; centre of a sphere or a rectangle
  vec3 direction{0.0f, -1.0f, 0.0f};    ///< directional: the way that its light goes, of any length
  float angle = 0;                      ///< directional: radius of its disk in the sky, radians; 0: sharp shadows
  float radius = 0;                     ///< sphere
  vec3 edge_u{1.0f, 0.0f, 0.0f},
      edge_v{0.0f, 1.0f, 0.0f};  ///< rectangle: whole sides; it shines along their cross product
};

/// What rays see that meet nothing else.
struct environment {
  vec3 color{0.0f};           ///< constant; the image's factor where there is one
  int width = 0, height = 0;  ///< of the image; 0: none
  std::vector<float> texels;  ///< [height][width][3], latitude-longitude: +y is up, the middle looks along -z
  mat3 to_image{1.0f};        ///< from the world's directions to the image's: a rotation
  bool visible = true;        ///< seen by the camera; else it sees render_options.background
};

/// All of it.
struct scene {
  std::vector<mesh> meshes;         ///< may be none
  std::vector<material> materials;  ///< of the meshes
  std::vector<texture> textures;    ///< of the materials
  std::vector<light> lights;        ///< may be none
  environment around;               ///< black where nothing is set
};

/// Throws invalid_argument for what cannot be traced. Such are numbers not finite or out of range, places that are not
/// there, and arrays whose sizes disagree.
void require_scene(scene const& s);

}  // namespace gart::light
