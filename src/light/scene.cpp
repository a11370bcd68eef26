// What of a scene cannot be traced.
#include <gart/core/error.hpp>
#include <gart/light/scene.hpp>

#include <cmath>

namespace gart::light {

namespace {

[[noreturn]] void refuse(std::string const& field, std::string const& what) {
  throw invalid_argument("light::scene." + field + " " + what);
}

std::string part_of(char const* list, std::size_t i, std::string const& name) {
  return std::string(list) + "[" + std::to_string(i) + "]" + (name.empty() ? "" : " ('" + name + "')");
}

template <class V>
bool finite(V const& v) {
  for (int k = 0; k < V::length(); ++k)
    if (!std::isfinite(v[k])) return false;
  return true;
}
bool all_finite(std::vector<float> const& values) {
  for (float const x : values)
    if (!std::isfinite(x)) return false;
  return true;
}
bool colors(vec3 const& c) { return finite(c) && c.x >= 0 && c.y >= 0 && c.z >= 0; }

void require_size(std::string const& field, std::size_t size, std::size_t wanted, std::string const& of) {
  if (size != wanted)
    refuse(field, "has " + std::to_string(size) + " entries, and " + of + " ask for " + std::to_string(wanted));
}

void require_texture(texture const& t, std::string const& at) {
  if (t.width < 1 || t.height < 1 || t.width > 65536 || t.height > 65536)
    refuse(at, "is " + std::to_string(t.width) + " x " + std::to_string(t.height) + " texels: give 1 to 65536 a side");
  std::size_t const texels = static_cast<std::size_t>(t.width) * static_cast<std::size_t>(t.height);
  require_size(at + ".texels", t.texels.size(), 4 * texels, std::to_string(texels) + " texels of four");
  if (!all_finite(t.texels)) refuse(at + ".texels", "has a number that is not finite");
}

void require_material(material const& m, std::size_t textures, std::string const& at) {
  auto const share = [&](char const* field, float x) {
    if (!(x >= 0 && x <= 1)) refuse(at + "." + field, "is " + std::to_string(x) + ": give 0 to 1");
  };
  for (int k = 0; k < 3; ++k) share("base_color", m.base_color[k]);
  share("metallic", m.metallic), share("roughness", m.roughness), share("opacity", m.opacity);
  share("cutout", m.cutout);
  if (!(m.ior >= 1 && m.ior <= 10)) refuse(at + ".ior", "is " + std::to_string(m.ior) + ": give 1 to 10");
  if (!colors(m.emission)) refuse(at + ".emission", "must be finite and not negative");
  auto const place = [&](char const* field, int number) {
    if (number >= 0 && static_cast<std::size_t>(number) >= textures)
      refuse(at + "." + field, "is " + std::to_string(number) + ", and there are " + std::to_string(textures) +
                                   " textures: add it, or give -1 for none");
  };
  place("base_color_texture", m.base_color_texture);
  place("metallic_roughness_texture", m.metallic_roughness_texture);
  place("emission_texture", m.emission_texture), place("normal_texture", m.normal_texture);
}

void require_mesh(mesh const& m, std::size_t materials, std::string const& at) {
  std::size_t const corners = m.positions.size(), count = m.triangles.size() / 3;
  if (m.triangles.size() % 3 != 0) refuse(at + ".triangles", "is no multiple of three numbers");
  for (std::size_t i = 0; i < m.triangles.size(); ++i)
    if (m.triangles[i] >= corners)
      refuse(at + ".triangles", "names corner " + std::to_string(m.triangles[i]) + " in triangle " +
                                    std::to_string(i / 3) + ", and there are " + std::to_string(corners) +
                                    " positions");
  auto const of_corners = std::to_string(corners) + " positions";
  if (!m.normals.empty()) require_size(at + ".normals", m.normals.size(), corners, of_corners);
  if (!m.uvs.empty()) require_size(at + ".uvs", m.uvs.size(), corners, of_corners);
  for (std::size_t i = 0; i < corners; ++i) {
    std::string const number = "[" + std::to_string(i) + "]";
    if (!finite(m.positions[i])) refuse(at + ".positions" + number, "is not finite");
    if (!m.normals.empty() && !finite(m.normals[i])) refuse(at + ".normals" + number, "is not finite");
    if (!m.uvs.empty() && !finite(m.uvs[i])) refuse(at + ".uvs" + number, "is not finite");
  }
  if (count > 0 && materials == 0) refuse("materials", "is empty, and " + at + " has triangles: give one at least");
  if (m.triangle_material.empty()) return;
  require_size(at + ".triangle_material", m.triangle_material.size(), count, std::to_string(count) + " triangles");
  for (u32 const number : m.triangle_material)
    if (number >= materials)
      refuse(at + ".triangle_material",
             "names material " + std::to_string(number) + ", and there are " + std::to_string(materials));
}

void require_light(light const& l, std::string const& at) {
  if (!colors(l.color)) refuse(at + ".color", "must be finite and not negative");
  if (!finite(l.position)) refuse(at + ".position", "is not finite");
  auto const has_length = [](vec3 const& v) { return finite(v) && glm::dot(v, v) > 1e-30f && glm::dot(v, v) < 1e30f; };
  switch (l.kind) {
    case light_kind::point:
      break;
    case light_kind::directional:
      if (!has_length(l.direction)) refuse(at + ".direction", "has no length: give the way that its light goes");
      if (!(l.angle >= 0 && l.angle <= 1.5f))
        refuse(at + ".angle", "is " + std::to_string(l.angle) + ": give 0 to 1.5 radians; the sun has 0.00465");
      break;
    case light_kind::sphere:
      if (!(l.radius > 0 && l.radius < 1e15f))
        refuse(at + ".radius", "is " + std::to_string(l.radius) + ": give a length, or make it a point light");
      break;
    case light_kind::rectangle:
      if (!has_length(l.edge_u)) refuse(at + ".edge_u", "has no length");
      if (!has_length(l.edge_v)) refuse(at + ".edge_v", "has no length");
      if (std::fabs(glm::dot(l.edge_u, l.edge_v)) >
          1e-3f * std::sqrt(glm::dot(l.edge_u, l.edge_u)) * std::sqrt(glm::dot(l.edge_v, l.edge_v)))
        refuse(at + ".edge_v", "is not at right angles to edge_u");
  }
}

void require_environment(environment const& e) {
  if (!colors(e.color)) refuse("around.color", "must be finite and not negative");
  mat3 const square = glm::transpose(e.to_image) * e.to_image;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (!(std::fabs(square[i][j] - (i == j ? 1.0f : 0.0f)) < 1e-3f)) refuse("around.to_image", "is no rotation");
  if (e.width == 0 && e.height == 0 && e.texels.empty()) return;
  if (e.width < 1 || e.height < 1 || e.width > 65536 || e.height > 65536)
    refuse("around", "is " + std::to_string(e.width) + " x " + std::to_string(e.height) +
                         " texels: give 1 to 65536 a side, or none and a constant colour");
  std::size_t const texels = static_cast<std::size_t>(e.width) * static_cast<std::size_t>(e.height);
  require_size("around.texels", e.texels.size(), 3 * texels, std::to_string(texels) + " texels of three");
  for (float const x : e.texels)
    if (!(std::isfinite(x) && x >= 0)) refuse("around.texels", "has a number that is negative or not finite");
}

}  // namespace

void require_scene(scene const& s) {
  std::size_t triangles = 0;
  for (std::size_t i = 0; i < s.textures.size(); ++i)
    require_texture(s.textures[i], part_of("textures", i, s.textures[i].name));
  for (std::size_t i = 0; i < s.materials.size(); ++i)
    require_material(s.materials[i], s.textures.size(), part_of("materials", i, s.materials[i].name));
  for (std::size_t i = 0; i < s.meshes.size(); ++i) {
    require_mesh(s.meshes[i], s.materials.size(), part_of("meshes", i, s.meshes[i].name));
    triangles += s.meshes[i].triangles.size() / 3;
  }
  if (triangles > (std::size_t{1} << 28))
    refuse("meshes", "has " + std::to_string(triangles) + " triangles, more than the 2^28 that can be traced");
  if (s.lights.size() > 1000)
    refuse("lights", "has " + std::to_string(s.lights.size()) + " entries: a ray is sent to each, give 1000 or fewer");
  for (std::size_t i = 0; i < s.lights.size(); ++i) require_light(s.lights[i], part_of("lights", i, s.lights[i].name));
  require_environment(s.around);
}

}  // namespace gart::light
