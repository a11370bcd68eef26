// GLB with KHR_gaussian_splatting: a glTF mesh of points whose attributes are Gaussians', unpacked, or packed as SPZ
// (KHR_gaussian_splatting_compression_spz_2). Axes: x left, y up, z forward. Read with the transforms of the nodes
// above, as far as Gaussians can be turned by them; written as floats.
// https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting

#include "bytes.hpp"
#include "gltf_document.hpp"
#include "packing.hpp"
#include "spz.hpp"
#include "surface.hpp"

#include <gart/core/version.hpp>
#include <gart/io/file.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/math/logit.hpp>
#include <gart/scene/similarity.hpp>

#include <nlohmann/json.hpp>

#include <limits>
#include <ostream>
#include <vector>

namespace gart {
namespace {

using namespace io;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr u32 magic = 0x46546c67, json_chunk = 0x4e4f534a, binary_chunk = 0x004e4942;
constexpr char const *extension = "KHR_gaussian_splatting", *spz_extension = "KHR_gaussian_splatting_compression_spz_2";
constexpr int up_axis = 2;  // half a turn about z is from a splat file's axes to glTF's
constexpr int array_buffer = 34962;

std::string attribute(std::string const& name) { return std::string(extension) + ":" + name; }

// The coefficient k of 16 in the extension's words.
std::string coefficient_name(int k) {
  int degree = 0;
  while (k >= (degree + 1) * (degree + 1)) ++degree;
  return attribute("SH_DEGREE_" + std::to_string(degree) + "_COEF_" + std::to_string(k - degree * degree));
}

// The half turn of a place.
vec3d turned(vec3d const& p) { return {-p.x, -p.y, p.z}; }

class glb_reader {
 public:
  explicit glb_reader(fs::path const& path) : file_(path), name_(file_.name()) {}

  gaussian_model read(splat_traits* traits, std::vector<std::string>* notes) {
    try {
      return from(file_.root(), traits, notes);
    } catch (json::exception const& e) {
      throw io_error(name_ + ": glTF", e.what(), "export it again");
    }
  }

 private:
  [[noreturn]] void refuse(std::string const& what, std::string const& remedy = "export it again") const {
    file_.refuse(what, remedy);
  }

  gaussian_model from(json const& document, splat_traits* traits, std::vector<std::string>* notes) {
    document_ = &document;
    if (document.contains("extensionsRequired"))
      for (auto const& needed : document["extensionsRequired"])
        if (needed != extension && needed != spz_extension)
          refuse("requires the extension " + needed.get<std::string>(),
                 std::string("gart reads ") + extension + ", and SPZ within it: export it without other compression");
    gaussian_model all;
    notes_ = notes, traits_ = traits;
    if (document.contains("scenes")) {
      auto const& scene = document["scenes"].at(document.value("scene", std::size_t{0}));
      if (scene.contains("nodes"))
        for (auto const& node : scene["nodes"]) visit(node.get<std::size_t>(), {}, 0, all);
    }
    if (!seen_)
      refuse(std::string("has no mesh with the extension ") + extension + " in its scene", "name a GLB of Gaussians");
    keep_usable(name_, all, notes);
    half_turn(all, up_axis);
    json const asset = document.value("asset", json::object());
    if (traits && asset.contains("extras") && asset["extras"].contains("gart"))
      for (auto const& [key, value] : asset["extras"]["gart"].items()) (*traits)[key] = value.get<std::string>();
    if (traits && origin_ != vec3d(0.0)) *traits = with_origin(*traits, origin_of(*traits, name_) + turned(origin_));
    return all;
  }

  void visit(std::size_t number, similarity const& above, int depth, gaussian_model& all) {
    if (depth > deepest_gltf_node)
      refuse("has nodes within each other more than " + std::to_string(deepest_gltf_node) + " deep");
    json const& node = document_->at("nodes").at(number);
    // glTF's nodes are trees; what is no tree can have as many ways through it as there are names.
    visited_.resize(document_->at("nodes").size());
    if (visited_[number]) refuse("node " + std::to_string(number) + " is below two others, or itself");
    visited_[number] = true;
    similarity const here = above * placement(node, number);
    if (node.contains("mesh"))
      for (auto const& primitive : document_->at("meshes").at(node["mesh"].get<std::size_t>()).at("primitives"))
        if (primitive.contains("extensions") && primitive["extensions"].contains(extension))
          add(primitive, primitive["extensions"][extension], here, all);
    if (node.contains("children"))
      for (auto const& child : node["children"]) visit(child.get<std::size_t>(), here, depth + 1, all);
  }

  similarity placement(json const& node, std::size_t number) const {
    try {
      if (node.contains("matrix")) {  // by columns
        auto const m = node["matrix"].get<std::array<double, 16>>();
        std::array<double, 16> rows;
        for (std::size_t i = 0; i < 16; ++i) rows[4 * (i % 4) + i / 4] = m[i];
        return similarity_of(rows);
      }
      similarity s;
      auto const t = node.value("translation", std::array<double, 3>{0, 0, 0}),
                 scale = node.value("scale", std::array<double, 3>{1, 1, 1});
      auto const r = node.value("rotation", std::array<double, 4>{0, 0, 0, 1});
      double const norm = r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3];
      if (!(norm > 0) || !std::isfinite(norm) || !(scale[0] > 0) || !std::isfinite(scale[0]) ||
          std::abs(scale[1] - scale[0]) > 1e-6 * scale[0] || std::abs(scale[2] - scale[0]) > 1e-6 * scale[0])
        throw invalid_argument("its scale is not one for all axes and above 0, or its rotation is none");
      s.rotation = rotation_of({r[3], r[0], r[1], r[2]}), s.scale = scale[0], s.translation = {t[0], t[1], t[2]};
      return s;
    } catch (invalid_argument const& e) {
      refuse("node " + std::to_string(number) + " is placed in a way that Gaussians cannot be: " + e.what(),
             "apply the node's transform in the program that wrote it, and export again");
    }
  }

  void add(json const& primitive, json const& how, similarity const& placed, gaussian_model& all) {
    // Drafts had neither, and meant these.
    bool const draft = how.contains("extensions") && how["extensions"].contains(spz_extension);
    if (how.value("kernel", draft ? "ellipse" : "") != "ellipse")
      refuse("has Gaussians of the kernel '" + how.value("kernel", "") + "'", "gart reads 'ellipse'");
    if (how.value("colorSpace", draft ? "srgb_rec709_display" : "") != "srgb_rec709_display")
      refuse("has colours in the space '" + how.value("colorSpace", "") + "'",
             "gart composites what is displayed, 'srgb_rec709_display': convert it");
    if (how.contains("extensions") && !how["extensions"].empty()) {
      if (how["extensions"].contains(spz_extension))
        return append(of_spz(how["extensions"][spz_extension]), placed, all);
      refuse("has Gaussians by the extension " + how["extensions"].begin().key(),
             std::string("gart reads ") + extension + ", and SPZ within it: export it without other compression");
    }
    auto const& attributes = primitive.at("attributes");
    int degree = 0;
    while (degree < 3 && attributes.contains(coefficient_name((degree + 1) * (degree + 1)))) ++degree;
    gaussian_model part;
    std::size_t const n = file_.count(attributes.at("POSITION"));
    require_plausible(name_, n + all.size(), std::max(degree, all.sh_degree), file_.all_bytes());
    part.resize(n, degree);
    auto const values = [&](std::string const& name, std::size_t width, auto const& store) {
      if (!attributes.contains(name)) refuse("the Gaussians have no attribute " + name);
      file_.each(attributes[name], "attribute " + name, n, width, store);
    };
    values("POSITION", 3,
           [&](std::size_t i, std::size_t c, double v) { part.mean[3 * i + c] = static_cast<float>(v); });
    values(attribute("ROTATION"), 4, [&](std::size_t i, std::size_t c, double v) {
      part.quaternion[4 * i + (c + 1) % 4] = static_cast<float>(v);
    });
    values(attribute("SCALE"), 3, [&](std::size_t i, std::size_t c, double v) {
      part.log_scale[3 * i + c] = static_cast<float>(std::log(v));  // of what is no length not finite
    });
    values(attribute("OPACITY"), 1, [&](std::size_t i, std::size_t, double v) {
      part.opacity[i] = v >= 0 && v <= 1 ? opacity_logit(v) : std::numeric_limits<float>::quiet_NaN();
    });
    std::size_t const k = static_cast<std::size_t>(sh_coefficients(degree));
    for (std::size_t j = 0; j < k; ++j)
      values(coefficient_name(static_cast<int>(j)), 3,
             [&](std::size_t i, std::size_t c, double v) { part.sh[3 * (k * i + j) + c] = static_cast<float>(v); });
    append(std::move(part), placed, all);
  }

  // SPZ is decoded into glTF's axes, as its own library does that is asked for them.
  gaussian_model of_spz(json const& packed) {
    auto const [at, size] = file_.view(packed.at("bufferView"), "its SPZ");
    gaussian_model part = read_spz({at, at + size}, name_ + ": SPZ", traits_, notes_);
    half_turn(part, up_axis);
    return part;
  }

  void append(gaussian_model part, similarity const& placed, gaussian_model& all) {
    int const degree = part.sh_degree;
    require_plausible(name_, part.size() + all.size(), std::max(degree, all.sh_degree), file_.all_bytes());
    apply_placement(from_origin(placed, part), part);
    seen_ = true;
    if (all.size() == 0) return void(all = std::move(part));
    // Of several meshes with other degrees, the highest holds all.
    int const most = std::max(degree, all.sh_degree);
    part = with_sh_degree(std::move(part), most), all = with_sh_degree(std::move(all), most);
    for_each_array(
        [](parameter_array const&, auto& to, auto const& from) { to.insert(to.end(), from.begin(), from.end()); }, all,
        part);
  }

  // Where a node puts its Gaussians so far from zero that floats would lose what they have, it is the origin.
  similarity from_origin(similarity placed, gaussian_model const& part) {
    if (!seen_ && placed.translation != vec3d(0.0)) {
      std::vector<vec3d> places;
      for (std::size_t i = 0; i < part.size(); ++i) {
        vec3d const p(part.mean[3 * i], part.mean[3 * i + 1], part.mean[3 * i + 2]);
        if (std::isfinite(p.x + p.y + p.z)) places.push_back(placed(p));
      }
      origin_ = origin_for(places);
    }
    placed.translation -= origin_;
    return placed;
  }

  // What stands where it is keeps its bits.
  static void apply_placement(similarity const& placed, gaussian_model& part) {
    if (placed.rotation != mat3d(1.0) || placed.scale != 1 || placed.translation != vec3d(0.0)) apply(placed, part);
  }

  gltf_document file_;
  std::string name_;
  json const* document_ = nullptr;
  std::vector<bool> visited_;
  splat_traits* traits_ = nullptr;
  std::vector<std::string>* notes_ = nullptr;
  bool seen_ = false;
  vec3d origin_{0.0};  // in glTF's axes
};

// Attributes one after the other: their bytes, and what glTF says of them.
struct glb_buffer {
  std::string bytes;
  json accessors = json::array(), views = json::array(), attributes = json::object();

  // n times `width` numbers of a type, value(i, c).
  template <class T>
  json& add(std::string const& name, std::size_t n, std::size_t width, int type, auto const& value) {
    static constexpr char const* shapes[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    std::size_t const at = bytes.size();
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < width; ++c) put(bytes, static_cast<T>(value(i, c)));
    views.push_back({{"buffer", 0}, {"byteOffset", at}, {"byteLength", bytes.size() - at}, {"target", array_buffer}});
    attributes[name] = accessors.size();
    accessors.push_back(
        {{"bufferView", views.size() - 1}, {"componentType", type}, {"count", n}, {"type", shapes[width - 1]}});
    return accessors.back();
  }
};

void write_glb(fs::path const& path, gaussian_model const& given, splat_traits const& all_traits,
               splat_packing const& packing) {
  require_packable(path, given);
  if (given.size() == 0) throw io_error(path.string(), "glTF has no mesh without a point", "keep some Gaussians");
  gaussian_model m = given;
  half_turn(m, up_axis);
  std::size_t const n = m.size(), k = static_cast<std::size_t>(sh_coefficients(m.sh_degree));
  glb_buffer out;
  json& position =
      out.add<float>("POSITION", n, 3, gltf_f32, [&](std::size_t i, std::size_t c) { return m.mean[3 * i + c]; });
  for (std::size_t c = 0; c < 3; ++c) {
    float least = m.mean[c], most = m.mean[c];
    for (std::size_t i = 0; i < n; ++i)
      least = std::min(least, m.mean[3 * i + c]), most = std::max(most, m.mean[3 * i + c]);
    position["min"].push_back(least), position["max"].push_back(most);
  }
  out.add<u8>("COLOR_0", n, 4, gltf_u8, [&](std::size_t i, std::size_t c) {
    if (c == 3) return u32{opacity_byte(m.opacity[i])};
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
  json asset = {{"version", "2.0"}, {"generator", std::string("gart ") + version}};
  splat_traits const traits = packing.world ? with_origin(all_traits, vec3d(0.0)) : all_traits;
  if (!traits.empty()) asset["extras"]["gart"] = traits;
  json node = {{"mesh", 0}};
  if (vec3d const place = turned(origin_of(all_traits, path.string())); packing.world && place != vec3d(0.0))
    node["translation"] = {place.x, place.y, place.z};
  json const how = {{"kernel", "ellipse"},
                    {"colorSpace", "srgb_rec709_display"},
                    {"projection", "perspective"},
                    {"sortingMethod", "cameraDistance"}};
  json const document = {
      {"asset", asset},
      {"extensionsUsed", {extension}},
      {"scene", 0},
      {"scenes", {{{"nodes", {0}}}}},
      {"nodes", json::array({node})},
      {"buffers", {{{"byteLength", out.bytes.size()}}}},
      {"bufferViews", out.views},
      {"accessors", out.accessors},
      {"meshes",
       {{{"primitives", {{{"attributes", out.attributes}, {"mode", 0}, {"extensions", {{extension, how}}}}}}}}}};
  std::string text = document.dump();
  text.resize((text.size() + 3) / 4 * 4, ' ');
  std::size_t const whole = 28 + text.size() + out.bytes.size();
  if (whole > 0xffffffffu)
    throw io_error(path.string(), "would be larger than the 4 GB of a GLB file",
                   "keep fewer Gaussians or a lower SH degree");
  std::string head;
  for (std::size_t const v : {std::size_t{magic}, std::size_t{2}, whole, text.size(), std::size_t{json_chunk}})
    put(head, static_cast<u32>(v));
  head += text;
  put(head, static_cast<u32>(out.bytes.size()));
  put(head, binary_chunk);
  write_file(path, [&](std::ostream& file) { file << head << out.bytes; });
}

}  // namespace

extern splat_format const glb_format;
splat_format const glb_format = {"GLB",
                                 ".glb",
                                 {.traits = true, .world = true},
                                 [](std::string_view first) { return first.starts_with("glTF"); },
                                 [](fs::path const& path, splat_traits* traits, std::vector<std::string>* notes) {
                                   return glb_reader(path).read(traits, notes);
                                 },
                                 write_glb};

}  // namespace gart
