// Writes GLB: Gaussians as floats, or packed as SPZ 2.

#include "bytes.hpp"
#include "glb.hpp"
#include "gltf_document.hpp"
#include "packing.hpp"
#include "spz.hpp"

#include <gart/core/version.hpp>
#include <gart/io/file.hpp>
#include <gart/io/origin.hpp>
#include <gart/math/logit.hpp>
#include <gart/math/srgb.hpp>

#include <nlohmann/json.hpp>

#include <cmath>
#include <ostream>
#include <vector>

namespace gart {
namespace {

using namespace io;
using namespace io::glb;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr int array_buffer = 34962;

// Attributes one after the other: their bytes, and their description in glTF.
struct glb_buffer {
  std::string bytes;
  json accessors = json::array(), views = json::array(), attributes = json::object();

  // n times `width` numbers of a type, value(i, c).
  template <class T>
  json& add(std::string const& name, std::size_t n, std::size_t width, int type, auto const& value) {
    std::size_t const at = bytes.size();
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < width; ++c) put(bytes, static_cast<T>(value(i, c)));
    views.push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes.size() - at}, {"target", array_buffer}});
    attributes[name] = accessors.size();
    accessors.push_back(
        {{"bufferView", views.size() - 1}, {"componentType", type}, {"count", n}, {"type", gltf_shapes[width - 1]}});
    return accessors.back();
  }
  // An attribute whose numbers are in the SPZ.
  json& name(std::string const& attribute, std::size_t n, std::size_t width, int type) {
    attributes[attribute] = accessors.size();
    accessors.push_back({{"componentType", type}, {"count", n}, {"type", gltf_shapes[width - 1]}});
    return accessors.back();
  }
};

// glTF wants the box of the positions.
void add_box(json& position, gaussian_model const& m) {
  for (std::size_t c = 0; c < 3; ++c) {
    float least = m.mean[c], most = m.mean[c];
    for (std::size_t i = 0; i < m.size(); ++i)
      least = std::min(least, m.mean[3 * i + c]), most = std::max(most, m.mean[3 * i + c]);
    position["min"].push_back(least), position["max"].push_back(most);
  }
}

glb_buffer as_floats(gaussian_model const& m) {
  std::size_t const n = m.size(), k = static_cast<std::size_t>(sh_coefficients(m.sh_degree));
  glb_buffer out;
  add_box(out.add<float>("POSITION", n, 3, gltf_f32, [&](std::size_t i, std::size_t c) { return m.mean[3 * i + c]; }),
          m);
  out.add<u8>("COLOR_0", n, 4, gltf_u8, [&](std::size_t i, std::size_t c) {
    if (c == 3) return u32{opacity_byte(m.opacity[i])};
    // glTF's fallback colours are linear light, a Gaussian's are as displayed.
    return unorm(linear_light(std::clamp(static_cast<double>(base_color(m.sh[3 * k * i + c])), 0.0, 1.0)), 8);
  })["normalized"] = true;
  std::vector<double> q(4 * n);
  for (std::size_t i = 0; i < n; ++i) {
    auto const u = unit(&m.quaternion[4 * i]);
    std::copy(u.begin(), u.end(), &q[4 * i]);
  }
  out.add<float>(attribute("ROTATION"), n, 4, gltf_f32,
                 [&](std::size_t i, std::size_t c) { return q[4 * i + (c + 1) % 4]; });
  out.add<float>(attribute("SCALE"), n, 3, gltf_f32, [&](std::size_t i, std::size_t c) {
    return std::exp(std::min(static_cast<double>(m.log_scale[3 * i + c]), 80.0));
  });
  out.add<float>(attribute("OPACITY"), n, 1, gltf_f32,
                 [&](std::size_t i, std::size_t) { return sigmoid_in_double(static_cast<double>(m.opacity[i])); });
  for (std::size_t j = 0; j < k; ++j)
    out.add<float>(coefficient_name(static_cast<int>(j)), n, 3, gltf_f32,
                   [&](std::size_t i, std::size_t c) { return m.sh[3 * (k * i + j) + c]; });
  return out;
}

// `m` is in glTF's axes, `given` in a splat file's, as the SPZ's writer takes it.
glb_buffer as_spz(fs::path const& path, gaussian_model const& m, gaussian_model const& given,
                  splat_traits const& traits, splat_packing const& packing) {
  std::size_t const n = m.size();
  glb_buffer out;
  add_box(out.name("POSITION", n, 3, gltf_f32), m);
  out.name("COLOR_0", n, 4, gltf_u8)["normalized"] = true;
  out.name(attribute("ROTATION"), n, 4, gltf_f32), out.name(attribute("SCALE"), n, 3, gltf_f32);
  out.name(attribute("OPACITY"), n, 1, gltf_f32);
  for (int j = 0; j < sh_coefficients(m.sh_degree); ++j) out.name(coefficient_name(j), n, 3, gltf_f32);
  std::vector<u8> const packed = spz_2(path, given, traits, packing);
  out.bytes.assign(packed.begin(), packed.end());
  out.views.push_back({{"buffer", 0}, {"byteLength", packed.size()}});
  return out;
}

}  // namespace

void io::glb::write(fs::path const& path, gaussian_model const& given, splat_traits const& all_traits,
                    splat_packing const& packing) {
  require_packable(path, given);
  if (given.size() == 0) throw io_error(path.string(), "glTF has no mesh without a point", "keep some Gaussians");
  gaussian_model m = given;
  half_turn(m, up_axis);
  glb_buffer out = packing.spz ? as_spz(path, m, given, all_traits, packing) : as_floats(m);
  std::size_t const used = out.bytes.size();
  out.bytes.resize((used + 3) / 4 * 4, '\0');
  json asset = {{"version", "2.0"}, {"generator", std::string("gart ") + version}};
  splat_traits const traits = packing.world ? with_origin(all_traits, vec3d(0.0)) : all_traits;
  if (!traits.empty()) asset["extras"]["gart"] = traits;
  json node = {{"mesh", 0}};
  if (vec3d const place = turned(origin_of(all_traits, path.string())); packing.world && place != vec3d(0.0))
    node["translation"] = {place.x, place.y, place.z};
  json how = {{"kernel", kernel},
              {"colorSpace", color_space},
              {"projection", "perspective"},
              {"sortingMethod", "cameraDistance"}};
  json used_extensions = json::array({extension});
  if (packing.spz) {
    how["extensions"][spz_extension] = {{"bufferView", 0}};
    used_extensions.push_back(spz_extension);
  }
  json document = {
      {"asset", asset},
      {"extensionsUsed", used_extensions},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", json::array({node})},
      {"buffers", {{{"byteLength", used}}}},
      {"bufferViews", out.views},
      {"accessors", out.accessors},
      {"meshes",
       {{{"primitives", {{{"attributes", out.attributes}, {"mode", 0}, {"extensions", {{extension, how}}}}}}}}}};
  if (packing.spz) document["extensionsRequired"] = used_extensions;
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::size_t const whole = 28 + text.size() + out.bytes.size();
  if (whole > 0xffffffffu)
    throw io_error(path.string(), "would be larger than the 4 GB of a GLB file",
                   "keep fewer Gaussians or a lower SH degree");
  std::string head;
  for (std::size_t const v : {std::size_t{glb_magic}, std::size_t{2}, whole, text.size(), std::size_t{glb_json_chunk}})
    put(head, static_cast<u32>(v));
  head += text;
  put(head, static_cast<u32>(out.bytes.size()));
  put(head, glb_binary_chunk);
  write_file(path, [&](std::ostream& file) { file << head << out.bytes; });
}

}  // namespace gart
