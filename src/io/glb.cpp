// GLB with KHR_gaussian_splatting: a glTF mesh of points whose attributes are Gaussians', unpacked, or packed as SPZ
// (KHR_gaussian_splatting_compression_spz_2). Axes: x left, y up, z forward. Read with the transforms of the nodes
// above, as far as Gaussians can be turned by them; written as floats.
// https://github.com/KhronosGroup/glTF/tree/main/extensions/2.0/Khronos/KHR_gaussian_splatting

#include "bytes.hpp"
#include "packing.hpp"
#include "spz.hpp"

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
constexpr int deepest_node = 64;

enum component { i8 = 5120, byte = 5121, i16 = 5122, word = 5123, f32 = 5126 };

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
  explicit glb_reader(fs::path const& path) : name_(path.string()), bytes_(read_file(path)) {}

  gaussian_model read(splat_traits* traits, std::vector<std::string>* notes) {
    try {
      return from(json_part(), traits, notes);
    } catch (json::exception const& e) {
      throw io_error(name_ + ": glTF", e.what(), "export it again");
    }
  }

 private:
  [[noreturn]] void refuse(std::string const& what, std::string const& remedy = "export it again") const {
    throw io_error(name_, what, remedy);
  }

  json json_part() {
    byte_reader in(bytes_, name_);
    if (in.get<u32>("the magic number") != magic) refuse("does not begin as GLB does", "name a GLB file");
    u32 const version = in.get<u32>("version");
    if (version != 2) refuse("is GLB of version " + std::to_string(version), "gart reads version 2: export it as that");
    in.skip(4, "the length");
    json document;
    bool known = false;
    while (in.remaining() >= 8) {
      u32 const size = in.get<u32>("a chunk"), type = in.get<u32>("a chunk");
      u8 const* const at = bytes_.data() + (bytes_.size() - in.remaining());
      in.skip(size, "a chunk");
      if (type == json_chunk && !known) document = json::parse(at, at + size), known = true;
      if (type == binary_chunk && !binary_) binary_ = at, binary_size_ = size;
    }
    if (!known || !document.is_object()) refuse("has no JSON chunk");
    return document;
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
    if (depth > deepest_node) refuse("has nodes within each other more than " + std::to_string(deepest_node) + " deep");
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
    std::size_t const n = document_->at("accessors").at(attributes.at("POSITION").get<std::size_t>()).at("count");
    require_plausible(name_, n + all.size(), std::max(degree, all.sh_degree), bytes_.size());
    part.resize(n, degree);
    auto const values = [&](std::string const& name, std::size_t width, auto const& store) {
      if (!attributes.contains(name)) refuse("the Gaussians have no attribute " + name);
      each(attributes[name].get<std::size_t>(), name, n, width, store);
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
    json const& view = document_->at("bufferViews").at(packed.at("bufferView").get<std::size_t>());
    u64 const start = view.value("byteOffset", u64{0}), size = view.at("byteLength").get<u64>();
    if (view.value("buffer", 0) != 0 || !binary_ || start > binary_size_ || size > binary_size_ - start)
      refuse("its SPZ reaches past the end of the file's buffer", "the file is truncated: copy or export it again");
    gaussian_model part = read_spz({binary_ + start, binary_ + start + size}, name_ + ": SPZ", traits_, notes_);
    half_turn(part, up_axis);
    return part;
  }

  void append(gaussian_model part, similarity const& placed, gaussian_model& all) {
    int const degree = part.sh_degree;
    require_plausible(name_, part.size() + all.size(), std::max(degree, all.sh_degree), bytes_.size());
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

  // store(i, c, value) for the numbers of an accessor.
  void each(std::size_t number, std::string const& name, std::size_t n, std::size_t width, auto const& store) const {
    json const& accessor = document_->at("accessors").at(number);
    int const type = accessor.at("componentType").get<int>();
    bool const normalized = accessor.value("normalized", false);
    static constexpr char const* shapes[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};
    if (accessor.at("type") != shapes[width - 1] || accessor.at("count").get<std::size_t>() != n ||
        accessor.contains("sparse") || !accessor.contains("bufferView"))
      refuse("attribute " + name + " is not " + std::to_string(n) + " " + shapes[width - 1] + " of a buffer");
    std::size_t size = 0;
    switch (type) {
      case i8:
      case byte:
        size = 1;
        break;
      case i16:
      case word:
        size = 2;
        break;
      case f32:
        size = 4;
        break;
      default:
        refuse("attribute " + name + " is of the component type " + std::to_string(type));
    }
    json const& view = document_->at("bufferViews").at(accessor["bufferView"].get<std::size_t>());
    if (view.value("buffer", 0) != 0 || !binary_ || document_->at("buffers").at(0).contains("uri"))
      refuse("attribute " + name + " is in a buffer outside of the file", "export it as one GLB file");
    u64 const stride = view.value("byteStride", u64{size * width}), in_view = accessor.value("byteOffset", u64{0}),
              start = view.value("byteOffset", u64{0});
    if (stride < size * width || stride > 255 || start > binary_size_ || in_view > binary_size_ - start ||
        (n > 0 && (binary_size_ - start - in_view < size * width ||
                   (n - 1) > (binary_size_ - start - in_view - size * width) / stride)))
      refuse("attribute " + name + " reaches past the end of the file's buffer",
             "the file is truncated: copy or export it again");
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < width; ++c)
        store(i, c, number_at(binary_ + start + in_view + stride * i + size * c, type, normalized));
  }

  static double number_at(u8 const* at, int type, bool normalized) {
    auto const as = [&](auto value, double most) {
      std::memcpy(&value, at, sizeof value);
      double const v = static_cast<double>(value);
      return normalized ? std::max(v / most, -1.0) : v;
    };
    switch (type) {
      case i8:
        return as(std::int8_t{}, 127);
      case byte:
        return as(u8{}, 255);
      case i16:
        return as(std::int16_t{}, 32767);
      case word:
        return as(u16{}, 65535);
    }
    float value;
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  }

  std::string name_;
  std::vector<u8> bytes_;
  u8 const* binary_ = nullptr;
  std::size_t binary_size_ = 0;
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

// glTF's fallback colours are linear light, a Gaussian's are as displayed.
double linear_light(double c) { return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4); }

void write_glb(fs::path const& path, gaussian_model const& given, splat_traits const& all_traits,
               splat_packing const& packing) {
  require_packable(path, given);
  if (given.size() == 0) throw io_error(path.string(), "glTF has no mesh without a point", "keep some Gaussians");
  gaussian_model m = given;
  half_turn(m, up_axis);
  std::size_t const n = m.size(), k = static_cast<std::size_t>(sh_coefficients(m.sh_degree));
  glb_buffer out;
  json& position =
      out.add<float>("POSITION", n, 3, f32, [&](std::size_t i, std::size_t c) { return m.mean[3 * i + c]; });
  for (std::size_t c = 0; c < 3; ++c) {
    float least = m.mean[c], most = m.mean[c];
    for (std::size_t i = 0; i < n; ++i)
      least = std::min(least, m.mean[3 * i + c]), most = std::max(most, m.mean[3 * i + c]);
    position["min"].push_back(least), position["max"].push_back(most);
  }
  out.add<u8>("COLOR_0", n, 4, byte, [&](std::size_t i, std::size_t c) {
    if (c == 3) return u32{opacity_byte(m.opacity[i])};
    return unorm(linear_light(std::clamp(static_cast<double>(base_color(m.sh[3 * k * i + c])), 0.0, 1.0)), 8);
  })["normalized"] = true;
  std::vector<double> q(4 * n);
  for (std::size_t i = 0; i < n; ++i) {
    auto const u = unit(&m.quaternion[4 * i]);
    std::copy(u.begin(), u.end(), &q[4 * i]);
  }
  out.add<float>(attribute("ROTATION"), n, 4, f32,
                 [&](std::size_t i, std::size_t c) { return q[4 * i + (c + 1) % 4]; });
  out.add<float>(attribute("SCALE"), n, 3, f32, [&](std::size_t i, std::size_t c) {
    return std::exp(std::min(static_cast<double>(m.log_scale[3 * i + c]), 80.0));
  });
  out.add<float>(attribute("OPACITY"), n, 1, f32,
                 [&](std::size_t i, std::size_t) { return sigmoid_in_double(static_cast<double>(m.opacity[i])); });
  for (std::size_t j = 0; j < k; ++j)
    out.add<float>(coefficient_name(static_cast<int>(j)), n, 3, f32,
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
