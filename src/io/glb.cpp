// Reads GLB, with the transforms of the nodes above, as far as Gaussians can be turned by them.

#include "glb.hpp"
#include "bytes.hpp"
#include "gltf_document.hpp"
#include "packing.hpp"
#include "spz.hpp"
#include "surface.hpp"

#include <gart/io/file.hpp>
#include <gart/io/json_fault.hpp>
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

class glb_reader {
 public:
  explicit glb_reader(fs::path const& path) : file_(path), name_(file_.name()) {}

  gaussian_model read(splat_traits* traits, std::vector<std::string>* notes) {
    try {
      return from(file_.root(), traits, notes);
    } catch (json::exception const& e) {
      throw io_error(name_ + ": glTF", json_fault_of(e.what()).what, "export it again");
    }
  }

 private:
  [[noreturn]] void refuse(std::string const& what, std::string const& remedy = "export it again") const {
    file_.refuse(what, remedy);
  }

  gaussian_model from(json const& document, splat_traits* traits, std::vector<std::string>* notes) {
    if (document.contains("extensionsRequired"))
      for (auto const& needed : document["extensionsRequired"])
        if (needed != extension && needed != spz_extension)
          refuse("requires the extension " + needed.get<std::string>(),
                 std::string("gart reads ") + extension + ", and SPZ within it: export it without other compression");
    gaussian_model all;
    notes_ = notes, traits_ = traits;
    file_.each_node(similarity(), [&](json const& node, std::size_t number, similarity const& above) {
      similarity const here = above * placement(node, number);
      if (node.contains("mesh"))
        for (auto const& primitive : document.at("meshes").at(node["mesh"].get<std::size_t>()).at("primitives"))
          if (primitive.contains("extensions") && primitive["extensions"].contains(extension))
            add(primitive, primitive["extensions"][extension], here, all);
      return here;
    });
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
      part.log_scale[3 * i + c] = static_cast<float>(std::log(v));  // not finite for a vector without length
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
    require_plausible(name_, part.size() + all.size(), std::max(part.sh_degree, all.sh_degree), file_.all_bytes());
    apply_placement(from_origin(placed, part), part);
    seen_ = true;
    gart::append(all, std::move(part));  // meshes may differ in degree
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

  // A Gaussian that is not moved keeps its bits.
  static void apply_placement(similarity const& placed, gaussian_model& part) {
    if (placed.rotation != mat3d(1.0) || placed.scale != 1 || placed.translation != vec3d(0.0)) apply(placed, part);
  }

  gltf_document file_;
  std::string name_;
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
