// Reads GLB, with the transforms of the nodes above, as far as Gaussians can be turned by them.

#include "glb.hpp"
#include "bytes.hpp"
#include "packing.hpp"
#include "spz.hpp"

#include <gart/io/file.hpp>
#include <gart/io/origin.hpp>
#include <gart/io/splat_file.hpp>
#include <gart/math/logit.hpp>
#include <gart/scene/similarity.hpp>

#include <nlohmann/json.hpp>

#include <limits>
#include <vector>

namespace gart {
namespace {

using namespace io;
using namespace io::glb;
using nlohmann::json;
namespace fs = std::filesystem;

constexpr int deepest_node = 64;

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
    if (how.value("kernel", draft ? kernel : "") != kernel)
      refuse("has Gaussians of the kernel '" + how.value("kernel", "") + "'", "gart reads 'ellipse'");
    if (how.value("colorSpace", draft ? color_space : "") != color_space)
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
    // Meshes may differ in degree; the highest holds all.
    int const most = std::max(degree, all.sh_degree);
    part = with_sh_degree(std::move(part), most), all = with_sh_degree(std::move(all), most);
    for_each_array(
        [](parameter_array const&, auto& to, auto const& from) { to.insert(to.end(), from.begin(), from.end()); }, all,
        part);
  }

  // A node that puts its Gaussians too far from zero for floats becomes the origin.
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

}  // namespace

extern splat_format const glb_format;
splat_format const glb_format = {"GLB",
                                 ".glb",
                                 {.traits = true, .world = true, .spz = true},
                                 [](std::string_view first) { return first.starts_with("glTF"); },
                                 [](fs::path const& path, splat_traits* traits, std::vector<std::string>* notes) {
                                   return glb_reader(path).read(traits, notes);
                                 },
                                 glb::write};

}  // namespace gart
