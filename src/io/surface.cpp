#include "surface.hpp"

#include "unusable.hpp"

#include <gart/math/srgb.hpp>

#include <algorithm>

namespace gart::io {
namespace {

constexpr double furthest = 1e15;  // squares of distances still are floats

bool near_enough(vec3d const& p) {  // NaN is not
  return std::abs(p.x) <= furthest && std::abs(p.y) <= furthest && std::abs(p.z) <= furthest;
}

}  // namespace

void add_placed(light::scene& to, raw_mesh const& raw, mesh_place const& place, std::string const& file,
                std::vector<std::string>& notes) {
  placing const& where = place.where;
  light::mesh out;
  out.name = raw.name;
  std::size_t const n = raw.position.size();
  std::vector<char> sound(n);
  out.positions.reserve(n);
  for (vec3d const& local : raw.position) {
    vec3d const p = where(local) - place.origin;
    sound[out.positions.size()] = near_enough(p);
    out.positions.push_back(near_enough(p) ? vec3(p) : vec3(0.0f));
  }
  mat3d const& m = where.linear;
  vec3d const across[3] = {glm::cross(m[1], m[2]), glm::cross(m[2], m[0]), glm::cross(m[0], m[1])};
  bool const mirrored = glm::dot(m[0], across[0]) < 0;
  out.normals.reserve(raw.normal.size());
  for (vec3 const& local : raw.normal) {  // by the cofactors, which keep it across the surface
    vec3d const v = (across[0] * static_cast<double>(local.x) + across[1] * static_cast<double>(local.y) +
                     across[2] * static_cast<double>(local.z)) *
                    (mirrored ? -1.0 : 1.0);
    double const length = glm::length(v);
    out.normals.push_back(length > 0 && std::isfinite(length) ? vec3(v / length) : vec3(0.0f));
  }
  for (vec2 const& uv : raw.uv) out.uvs.push_back(std::abs(uv.x) < 1e6f && std::abs(uv.y) < 1e6f ? uv : vec2(0.0f));

  std::size_t far = 0, thin = 0;
  for (std::size_t t = 0; t < raw.triangle.size(); ++t) {
    auto [a, b, c] = raw.triangle[t];
    if (mirrored) std::swap(b, c);
    if (!sound[a] || !sound[b] || !sound[c]) {
      ++far;
      continue;
    }
    vec3d const at(out.positions[a]);
    vec3d const face = glm::cross(vec3d(out.positions[b]) - at, vec3d(out.positions[c]) - at);
    double const area = glm::length(face);
    if (!(area > 0)) {
      ++thin;
      continue;
    }
    if (!out.normals.empty())
      for (u32 const corner : {a, b, c})
        if (out.normals[corner] == vec3(0.0f)) out.normals[corner] = vec3(face / area);
    out.triangles.insert(out.triangles.end(), {a, b, c});
    out.triangle_material.push_back(raw.material[t]);
  }
  for (vec3& normal : out.normals)
    if (normal == vec3(0.0f)) normal = vec3(0.0f, 0.0f, 1.0f);  // of no triangle
  std::string const what = file + (raw.name.empty() ? "" : ", mesh '" + raw.name + "'");
  if (far) notes.push_back(counted(far, "triangle") + " of " + what + " left out: corners not finite or beyond 1e15");
  if (thin) notes.push_back(counted(thin, "triangle") + " of " + what + " left out: without an area");
  if (!out.triangles.empty()) to.meshes.push_back(std::move(out));
}

void require_meshes(light::scene const& scene, std::string const& file, std::vector<std::string> const& notes) {
  if (scene.meshes.empty())
    throw io_error(file, "has no triangle that can be traced" + (notes.empty() ? "" : " (" + notes.back() + ")"),
                   "name a file of a mesh, or export it again");
}

light::texture texture_of(image8 const& image, bool colours, std::string name) {
  float value[256];
  for (int i = 0; i < 256; ++i) value[i] = static_cast<float>(colours ? linear_light(i / 255.0) : i / 255.0);
  light::texture out;
  out.name = std::move(name), out.width = image.width, out.height = image.height;
  auto const channels = static_cast<std::size_t>(image.channels);
  std::size_t const pixels = image.data.size() / channels;
  out.texels.reserve(4 * pixels);
  for (std::size_t i = 0; i < pixels; ++i) {
    u8 const* const p = &image.data[i * channels];
    for (std::size_t c = 0; c < 3; ++c) out.texels.push_back(value[p[channels < 3 ? 0 : c]]);
    out.texels.push_back(channels == 4 ? static_cast<float>(p[3]) / 255.0f : 1.0f);
  }
  return out;
}

void append(light::scene& all, light::scene part) {
  auto const textures = static_cast<int>(all.textures.size());
  auto const materials = static_cast<u32>(all.materials.size());
  for (light::material& m : part.materials)
    for (int* const number :
         {&m.base_color_texture, &m.metallic_roughness_texture, &m.emission_texture, &m.normal_texture})
      if (*number >= 0) *number += textures;
  for (light::mesh& m : part.meshes)
    for (u32& number : m.triangle_material) number += materials;
  auto const move = [](auto& from, auto& to) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  };
  move(part.textures, all.textures), move(part.materials, all.materials);
  move(part.meshes, all.meshes), move(part.lights, all.lights);
}

}  // namespace gart::io
