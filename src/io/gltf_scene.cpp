// Meshes of triangles, materials, lights and cameras of glTF 2.0, placed by the nodes above them.
// Extensions: KHR_lights_punctual, KHR_materials_transmission, _ior, _emissive_strength, _unlit, EXT_texture_webp.

#include "codec.hpp"
#include "gltf_document.hpp"
#include "scene_parts.hpp"
#include "unusable.hpp"

#include <gart/io/json_fault.hpp>
#include <gart/scene/similarity.hpp>

#include <map>
#include <set>
#include <tuple>

namespace gart::io {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr char const* splats = "KHR_gaussian_splatting";
constexpr char const* known_extensions[] = {"KHR_lights_punctual",
                                            "KHR_materials_transmission",
                                            "KHR_materials_ior",
                                            "KHR_materials_emissive_strength",
                                            "KHR_materials_unlit",
                                            "KHR_materials_volume",
                                            "EXT_texture_webp",
                                            "KHR_mesh_quantization",
                                            splats,
                                            "KHR_gaussian_splatting_compression_spz_2"};
// Of a mesh that many nodes show: each would be a copy.
constexpr std::size_t most_triangles_a_byte = 16;
constexpr int lines_of_cameras = 720;

template <std::size_t n>
std::array<double, n> numbers(json const& at, char const* key, std::array<double, n> otherwise) {
  return at.contains(key) ? at[key].get<std::array<double, n>>() : otherwise;
}

bool has_extension(json const& at, char const* name) {
  return at.contains("extensions") && at["extensions"].contains(name);
}

class gltf_reader {
 public:
  gltf_reader(fs::path const& path, mesh_place const& place, std::vector<std::string>& notes)
      : file_(path), place_(place), notes_(notes) {}

  gltf_parts read() {
    try {
      json const& root = file_.root();
      if (root.contains("extensionsRequired"))
        for (auto const& needed : root["extensionsRequired"])
          if (std::find(std::begin(known_extensions), std::end(known_extensions), needed) == std::end(known_extensions))
            file_.refuse("requires the extension " + needed.get<std::string>().substr(0, 60),
                         "export it without (compression is packed, and gart reads plain buffers)");
      read_materials();
      file_.each_node(place_.where, [&](auto const&... of_node) { return visit(of_node...); });
      for (auto const& [what, n] : left_out_)
        notes_.push_back(counted(n, what.c_str()) + " of " + file_.name() + " left out");
      return std::move(out_);
    } catch (json::exception const& e) {
      throw io_error(file_.name() + ": glTF", json_fault_of(e.what()).what, "export it again");
    }
  }

 private:
  void read_materials() {
    json const& root = file_.root();
    if (root.contains("materials"))
      for (std::size_t i = 0; i < root["materials"].size(); ++i)
        out_.scene.materials.push_back(material_of(root["materials"][i], i));
    out_.scene.materials.emplace_back();  // glTF's own, of triangles without
    light::material& plain = out_.scene.materials.back();
    plain.name = "default", plain.base_color = vec3(1.0f), plain.metallic = 1;
  }

  light::material material_of(json const& from, std::size_t number) {
    light::material m;
    std::string const what = "material " + std::to_string(number);
    m.name = from.value("name", what);
    auto const unit = [&](double v, char const* field) {
      if (!(v >= 0 && v <= 1)) file_.refuse(what + ": '" + field + "' is not between 0 and 1", "correct it");
      return static_cast<float>(v);
    };
    json const metal = from.value("pbrMetallicRoughness", json::object());
    auto const base = numbers<4>(metal, "baseColorFactor", {1, 1, 1, 1});
    for (int c = 0; c < 3; ++c) m.base_color[c] = unit(base[static_cast<std::size_t>(c)], "baseColorFactor");
    m.metallic = unit(metal.value("metallicFactor", 1.0), "metallicFactor");
    m.roughness = unit(metal.value("roughnessFactor", 1.0), "roughnessFactor");
    m.base_color_texture = texture_number(metal, "baseColorTexture", true, what);
    m.metallic_roughness_texture = texture_number(metal, "metallicRoughnessTexture", false, what);
    m.normal_texture = texture_number(from, "normalTexture", false, what);
    m.emission_texture = texture_number(from, "emissiveTexture", true, what);
    auto const shine = numbers<3>(from, "emissiveFactor", {0, 0, 0});
    json const more = from.value("extensions", json::object());
    auto const of = [&](char const* extension, char const* key, double otherwise) {
      return more.contains(extension) ? more[extension].value(key, otherwise) : otherwise;
    };
    double const strength = of("KHR_materials_emissive_strength", "emissiveStrength", 1);
    for (int c = 0; c < 3; ++c) {
      double const v = shine[static_cast<std::size_t>(c)] * strength;
      if (!(v >= 0 && v <= 1e9)) file_.refuse(what + ": 'emissiveFactor' is not between 0 and 1e9", "correct it");
      m.emission[c] = static_cast<float>(v);
    }
    double const ior = of("KHR_materials_ior", "ior", 1.5);
    if (!(ior >= 1 && ior <= 10)) file_.refuse(what + ": 'ior' is not between 1 and 10", "correct it");
    m.ior = static_cast<float>(ior);
    std::string const alpha = from.value("alphaMode", "OPAQUE");
    if (alpha == "MASK") {
      m.cutout = std::max(unit(from.value("alphaCutoff", 0.5), "alphaCutoff"), 1e-6f);
      m.opacity = unit(base[3], "baseColorFactor");
    } else if (alpha == "BLEND") {
      m.opacity = unit(base[3], "baseColorFactor");
    } else if (m.base_color_texture >= 0) {
      make_opaque(m.base_color_texture);
    }
    if (of("KHR_materials_transmission", "transmissionFactor", 0) >= 0.5) m.kind = light::material_kind::dielectric;
    if (more.contains("KHR_materials_unlit")) {
      m.emission = m.base_color, m.emission_texture = m.base_color_texture;
      m.base_color = vec3(0.0f), m.base_color_texture = -1, m.metallic = 0, m.roughness = 1;
    }
    return m;
  }

  // The alpha of a texture counts where the material says so.
  void make_opaque(int& number) {
    light::texture& t = out_.scene.textures[static_cast<std::size_t>(number)];
    bool opaque = true;
    for (std::size_t i = 3; i < t.texels.size(); i += 4) opaque = opaque && t.texels[i] == 1.0f;
    if (opaque) return;
    light::texture copy = t;
    for (std::size_t i = 3; i < copy.texels.size(); i += 4) copy.texels[i] = 1.0f;
    number = static_cast<int>(out_.scene.textures.size());
    out_.scene.textures.push_back(std::move(copy));
  }

  int texture_number(json const& at, char const* key, bool colours, std::string const& what) {
    if (!at.contains(key)) return -1;
    json const& info = at[key];
    std::string const where = what + ", '" + key + "'";
    if (info.value("texCoord", 0) != 0)
      file_.refuse(where + ": 'texCoord' is " + std::to_string(info.value("texCoord", 0)), "gart reads the first, 0");
    if (has_extension(info, "KHR_texture_transform")) ++left_out_["KHR_texture_transform of a texture"];
    json const& texture = file_.root().at("textures").at(info.at("index").get<std::size_t>());
    json const& source =
        has_extension(texture, "EXT_texture_webp") ? texture["extensions"]["EXT_texture_webp"] : texture;
    if (!source.contains("source")) file_.refuse(where + " has no image", "save it with PNG, JPEG or WebP images");
    std::size_t const image = source["source"].get<std::size_t>();
    bool repeat[2] = {true, true};
    if (texture.contains("sampler")) {
      json const& sampler = file_.root().at("samplers").at(texture["sampler"].get<std::size_t>());
      constexpr int clamp_to_edge = 33071;
      repeat[0] = sampler.value("wrapS", 0) != clamp_to_edge, repeat[1] = sampler.value("wrapT", 0) != clamp_to_edge;
    }
    auto const [known, is_new] = textures_.try_emplace({image, colours, repeat[0], repeat[1]}, 0);
    if (is_new) {
      known->second = static_cast<int>(out_.scene.textures.size());
      light::texture t = texture_of(image_of(image, where), colours, "image " + std::to_string(image));
      t.repeat_u = repeat[0], t.repeat_v = repeat[1];
      out_.scene.textures.push_back(std::move(t));
    }
    return known->second;
  }

  image8 image_of(std::size_t number, std::string const& what) {
    json const& image = file_.root().at("images").at(number);
    std::string const name = "image " + std::to_string(number) + " of " + what;
    if (image.contains("bufferView")) {
      auto const [bytes, size] = file_.view(image["bufferView"], name);
      return decode_image({bytes, bytes + size}, file_.name() + ": " + name);
    }
    std::string const uri = image.at("uri").get<std::string>();
    return decode_image(file_.uri_bytes(uri, name), file_.uri_name(uri) + ": " + name);
  }

  placing visit(json const& node, std::size_t number, placing const& above) {
    placing const here = above * placement(node, number);
    if (node.contains("skin")) ++left_out_["skin"];
    if (node.contains("mesh")) add_mesh(node["mesh"].get<std::size_t>(), here);
    if (has_extension(node, "KHR_lights_punctual"))
      add_light(node["extensions"]["KHR_lights_punctual"].at("light").get<std::size_t>(), here);
    if (node.contains("camera")) add_camera(node["camera"].get<std::size_t>(), here, node, number);
    return here;
  }

  placing placement(json const& node, std::size_t number) const {
    placing p;
    if (node.contains("matrix")) {  // by columns
      auto const m = node["matrix"].get<std::array<double, 16>>();
      for (int c = 0; c < 3; ++c)
        for (int r = 0; r < 3; ++r) p.linear[c][r] = m[static_cast<std::size_t>(4 * c + r)];
      p.translation = {m[12], m[13], m[14]};
    } else {
      auto const t = numbers<3>(node, "translation", {0, 0, 0}), s = numbers<3>(node, "scale", {1, 1, 1});
      auto const r = numbers<4>(node, "rotation", {0, 0, 0, 1});
      if (!(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3] > 1e-12))
        file_.refuse("node " + std::to_string(number) + ": 'rotation' is all zero", "write a unit quaternion");
      p.linear = rotation_of({r[3], r[0], r[1], r[2]}), p.translation = {t[0], t[1], t[2]};
      for (int c = 0; c < 3; ++c) p.linear[c] *= s[static_cast<std::size_t>(c)];
    }
    double sum = p.translation.x + p.translation.y + p.translation.z;
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) sum += p.linear[c][r];
    if (!std::isfinite(sum)) file_.refuse("node " + std::to_string(number) + " is not placed by finite numbers");
    return p;
  }

  void add_mesh(std::size_t number, placing const& where) {
    json const& mesh = file_.root().at("meshes").at(number);
    std::size_t part = 0;
    for (auto const& primitive : mesh.at("primitives")) {
      std::string const what = "mesh " + std::to_string(number) + ", part " + std::to_string(part++);
      int const mode = primitive.value("mode", 4);
      if (has_extension(primitive, splats)) continue;
      if (mode < 4 || mode > 6) {
        ++left_out_["part of points or lines"];
        continue;
      }
      if (primitive.contains("targets")) ++left_out_["set of morph targets"];
      raw_mesh raw = primitive_of(primitive, mode, what);
      raw.name = mesh.value("name", "mesh " + std::to_string(number)) + (part > 1 ? "." + std::to_string(part) : "");
      if ((triangles_ += raw.triangle.size()) > most_triangles_a_byte * file_.all_bytes())
        file_.refuse("shows its meshes so often that they are more than " +
                         std::to_string(most_triangles_a_byte * file_.all_bytes()) + " triangles",
                     "show them by fewer nodes");
      add_placed(out_.scene, raw, {where, place_.origin}, file_.name(), notes_);
    }
  }

  raw_mesh primitive_of(json const& primitive, int mode, std::string const& what) {
    json const& attributes = primitive.at("attributes");
    if (!attributes.contains("POSITION")) file_.refuse(what + " has no attribute POSITION");
    raw_mesh raw;
    std::size_t const n = plausible(file_.count(attributes["POSITION"]), what + ", POSITION");
    raw.position.resize(n);
    auto const read = [&](char const* name, auto& to, std::size_t width) {
      if (!attributes.contains(name)) return;
      to.resize(n);
      file_.each(attributes[name], what + ", " + name, n, width,
                 [&](std::size_t i, std::size_t c, double v) { store(to[i], c, v); });
    };
    read("POSITION", raw.position, 3), read("NORMAL", raw.normal, 3), read("TEXCOORD_0", raw.uv, 2);
    std::vector<u32> corners;
    if (primitive.contains("indices")) {
      corners.resize(plausible(file_.count(primitive["indices"]), what + ", indices"));
      file_.each(primitive["indices"], what + ", indices", corners.size(), 1,
                 [&](std::size_t i, std::size_t, double v) {
                   if (!(v >= 0 && v < static_cast<double>(n)))
                     file_.refuse(what + ": a triangle has the corner " + std::to_string(v) + ", and there are " +
                                  std::to_string(n) + " vertices");
                   corners[i] = static_cast<u32>(v);
                 });
    } else {
      corners.resize(n);
      for (std::size_t i = 0; i < n; ++i) corners[i] = static_cast<u32>(i);
    }
    if (mode == 4)
      for (std::size_t i = 0; i + 2 < corners.size(); i += 3)
        raw.triangle.push_back({corners[i], corners[i + 1], corners[i + 2]});
    else
      for (std::size_t i = 0; i + 2 < corners.size(); ++i)  // a strip turns every other one, a fan is about its first
        raw.triangle.push_back(
            {corners[mode == 6 ? 0 : i], corners[i + 1 + (mode == 5 && i % 2)], corners[i + 2 - (mode == 5 && i % 2)]});
    std::size_t const materials = out_.scene.materials.size() - 1;
    std::size_t const material = primitive.contains("material") ? primitive["material"].get<std::size_t>() : materials;
    if (material > materials)
      file_.refuse(what + ": 'material' is " + std::to_string(material) + ", and there are " +
                   std::to_string(materials));
    raw.material.assign(raw.triangle.size(), static_cast<u32>(material));
    return raw;
  }

  static void store(vec3d& to, std::size_t c, double v) { to[static_cast<int>(c)] = v; }
  static void store(vec3& to, std::size_t c, double v) { to[static_cast<int>(c)] = static_cast<float>(v); }
  static void store(vec2& to, std::size_t c, double v) { to[static_cast<int>(c)] = static_cast<float>(v); }

  // Before memory is taken: an element is a byte at least.
  std::size_t plausible(std::size_t n, std::string const& what) {
    if (n > file_.all_bytes() || n > 0xfffffff0u)
      file_.refuse(what + " has " + std::to_string(n) + " elements, more than the file has bytes",
                   "the file is damaged: export it again");
    return n;
  }

  void add_light(std::size_t number, placing const& where) {
    json const& from = file_.root().at("extensions").at("KHR_lights_punctual").at("lights").at(number);
    std::string const what = "light " + std::to_string(number), type = from.at("type").get<std::string>();
    light::light l;
    l.name = from.value("name", what);
    if (type == "directional")
      l.kind = light::light_kind::directional;
    else if (type != "point" && type != "spot")
      file_.refuse(what + ": 'type' is '" + type.substr(0, 60) + "'", "point, spot and directional are read");
    if (type == "spot") ++left_out_["cone of a spot light"];
    auto const color = numbers<3>(from, "color", {1, 1, 1});
    double const intensity = from.value("intensity", 1.0);
    for (int c = 0; c < 3; ++c) {
      double const v = color[static_cast<std::size_t>(c)] * intensity;
      if (!(v >= 0 && v <= 1e12))
        file_.refuse(what + ": 'color' or 'intensity' is not between 0 and 1e12", "correct it");
      l.color[c] = static_cast<float>(v);
    }
    l.position = vec3(where.translation - place_.origin);
    vec3d const d = where.linear * vec3d(0, 0, -1);
    l.direction = vec3(d / glm::length(d));
    if (!std::isfinite(l.direction.x + l.direction.y + l.direction.z + l.position.x + l.position.y + l.position.z))
      file_.refuse(what + " is placed by no finite numbers, or turned by none", "correct the node that it is of");
    out_.scene.lights.push_back(l);
  }

  void add_camera(std::size_t number, placing const& where, json const& node, std::size_t at) {
    json const& from = file_.root().at("cameras").at(number);
    if (from.value("type", "") != "perspective") return void(++left_out_["camera that is not a perspective"]);
    json const& lens = from.at("perspective");
    double const angle = lens.at("yfov").get<double>(), aspect = lens.value("aspectRatio", 16.0 / 9);
    named_camera c;
    c.name = node.value("name", "camera_" + std::to_string(at));
    vec3d x = where.linear[0], z = -where.linear[2];
    x /= glm::length(x), z /= glm::length(z);
    vec3d const y = glm::cross(z, x);
    double const skew = std::abs(glm::dot(x, z));
    if (!(angle > 0.001 && angle < 3.1) || !(aspect > 0.01 && aspect < 100) || !(skew < 1e-3))
      file_.refuse("camera " + std::to_string(number) + " has no angle and shape that can be, or leans",
                   "correct 'yfov', 'aspectRatio' and its node");
    c.view.height = lines_of_cameras, c.view.width = static_cast<int>(std::lround(aspect * lines_of_cameras));
    c.view.fx = c.view.fy = static_cast<float>(0.5 * lines_of_cameras / std::tan(angle / 2));
    c.view.cx = 0.5f * static_cast<float>(c.view.width), c.view.cy = 0.5f * lines_of_cameras;
    c.view.rotation = mat3(vec3(x), vec3(y), vec3(z)), c.view.position = where.translation;
    out_.cameras.push_back(std::move(c));
  }

  gltf_document file_;
  mesh_place place_;
  std::vector<std::string>& notes_;
  gltf_parts out_;
  std::map<std::tuple<std::size_t, bool, bool, bool>, int> textures_;
  std::map<std::string, std::size_t> left_out_;
  std::size_t triangles_ = 0;
};

}  // namespace

gltf_parts read_gltf_scene(fs::path const& path, mesh_place const& place, std::vector<std::string>& notes) {
  return gltf_reader(path, place, notes).read();
}

gltf_contents gltf_contents_of(fs::path const& path) {
  gltf_document const file(path);
  gltf_contents has;
  try {
    if (file.root().contains("meshes"))
      for (auto const& mesh : file.root()["meshes"])
        for (auto const& primitive : mesh.at("primitives"))
          (has_extension(primitive, splats) ? has.splats : has.meshes) = true;
  } catch (json::exception const& e) {
    throw io_error(file.name() + ": glTF", json_fault_of(e.what()).what, "export it again");
  }
  return has;
}

}  // namespace gart::io
