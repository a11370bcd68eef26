// scene.json: models, meshes, materials, lights, surroundings, cameras, options.

#include "capture.hpp"
#include "json_checks.hpp"
#include "scene_parts.hpp"

#include <gart/core/words.hpp>
#include <gart/io/camera_file.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/exr_file.hpp>
#include <gart/io/image_file.hpp>
#include <gart/io/scene_file.hpp>
#include <gart/scene/similarity.hpp>

#include <algorithm>
#include <numbers>

namespace gart {
namespace {

namespace fs = std::filesystem;
using namespace io;

std::string ending_of(fs::path const& path) { return lower(path.extension().string()); }

bool is_gltf(fs::path const& path) { return ending_of(path) == ".glb" || ending_of(path) == ".gltf"; }

constexpr vec3d none(0.0);

placed_splats placed(record const& r) {
  placed_splats p;
  p.rotation = numbers<4>(r, "rotation", p.rotation);
  auto const [w, x, y, z] = p.rotation;
  if (!(w * w + x * x + y * y + z * z > 1e-12))
    throw io_error(r.where, "'rotation' is all zero, which is none", "write a quaternion w, x, y, z");
  p.translation = three(r, "translation", none);
  return p;
}

class scene_reader {
 public:
  explicit scene_reader(fs::path const& path) : scene_reader(path, io::read_json(path)) {}
  scene_reader(fs::path const& path, json root)
      : path_(path), root_(std::move(root)), top_{root_, nullptr, path.string()} {
    require_keys(top_,
                 {"models", "up", "background", "meshes", "materials", "lights", "environment", "cameras", "options"});
  }

  std::vector<placed_splats> splats() const {
    std::vector<placed_splats> all;
    each("models", "model", [&](record const& r) {
      require_keys(r, {"name", "file", "translation", "rotation", "scale"});
      placed_splats p = placed(r);
      p.file = file_of(r, "file"), p.scale = number_within(r, "scale", 1, 1e-9, 1e9);
      all.push_back(p);
    });
    return all;
  }

  scene_file read(vec3d const& origin) {
    origin_ = origin;
    vec3d const up = three(top_, "up", {0, -1, 0});
    if (!(up.x * up.x + up.y * up.y + up.z * up.z > 1e-12))
      throw io_error(path_.string(), "'up' is all zero", "write the way up in the world, as [0, -1, 0]");
    turn_ = io::turn_from_y(up);
    if (top_.has("background")) out_.background = vec3(three(top_, "background", none, 0, 1e6));
    read_materials(), read_meshes(), read_lights(), read_environment(), read_cameras(), read_options();
    return std::move(out_);
  }

 private:
  // f(record) for each element of a list; its place names it.
  template <class F>
  void each(char const* list, char const* noun, F const& f) const {
    json const* const all = top_.find(list);
    if (!all) return;
    if (!all->is_array()) throw io_error(top_.where, std::string("'") + list + "' is no list", "write [...]");
    for (std::size_t i = 0; i < all->size(); ++i) {
      json const& one = (*all)[i];
      std::string where = top_.where + ": " + noun + " " + std::to_string(i);
      if (one.is_object() && one.contains("name") && one["name"].is_string())
        where += " '" + one["name"].get<std::string>().substr(0, 60) + "'";
      f(record{one, nullptr, where});
    }
  }

  fs::path file_of(record const& r, char const* key) const {
    std::string const name = r.text(key);
    fs::path const file = path_.parent_path() / name;
    std::error_code ignored;
    if (name.empty() || name.find('\0') != std::string::npos || !fs::exists(file, ignored))
      throw io_error(
          r.where, std::string("'") + key + "' is '" + name.substr(0, 200) + "', which is not there",
          "name a file by its path from " + (path_.has_parent_path() ? path_.parent_path() : fs::path(".")).string());
    return file;
  }

  static std::string name_of(record const& r) { return r.has("name") ? r.text("name") : ""; }

  void read_materials() {
    each("materials", "material", [&](record const& r) {
      require_keys(r, {"name", "kind", "base_color", "metallic", "roughness", "ior", "emission", "opacity", "cutout",
                       "base_color_texture", "metallic_roughness_texture", "emission_texture", "normal_texture"});
      light::material m;
      m.name = r.text("name");
      if (material_number(m.name) >= 0) throw io_error(r.where, "'name' is that of another material", "rename one");
      m.kind = choice(r, "kind", m.kind);
      bool const reflects = m.kind == light::material_kind::mirror || m.kind == light::material_kind::dielectric;
      m.base_color = vec3(three(r, "base_color", reflects ? vec3d(1.0) : vec3d(m.base_color), 0, 1));
      m.metallic = static_cast<float>(number_within(r, "metallic", 0, 0, 1));
      m.roughness = static_cast<float>(number_within(r, "roughness", 1, 0, 1));
      m.ior = static_cast<float>(number_within(r, "ior", 1.5, 1, 10));
      m.emission = vec3(three(r, "emission", none, 0, 1e9));
      m.opacity = static_cast<float>(number_within(r, "opacity", 1, 0, 1));
      m.cutout = static_cast<float>(number_within(r, "cutout", 0, 0, 1));
      auto const texture = [&](char const* key, bool colours) {
        if (!r.has(key)) return -1;
        out_.scene.textures.push_back(io::texture_of(read_image(file_of(r, key)), colours, r.text(key)));
        return static_cast<int>(out_.scene.textures.size()) - 1;
      };
      m.base_color_texture = texture("base_color_texture", true),
      m.emission_texture = texture("emission_texture", true);
      m.metallic_roughness_texture = texture("metallic_roughness_texture", false);
      m.normal_texture = texture("normal_texture", false);
      out_.scene.materials.push_back(std::move(m));
    });
  }

  int material_number(std::string const& name) const {
    auto const& all = out_.scene.materials;
    for (std::size_t i = 0; i < std::min(named_, all.size()); ++i)
      if (all[i].name == name) return static_cast<int>(i);
    return -1;
  }

  void read_meshes() {
    named_ = out_.scene.materials.size();
    int entry = 0;
    each("meshes", "mesh", [&](record const& r) {
      require_keys(r, {"name", "file", "shape", "translation", "rotation", "scale", "material"});
      if (r.has("file") == r.has("shape"))
        throw io_error(r.where, r.has("file") ? "has a 'file' and a 'shape'" : "has no 'file' and no 'shape'",
                       "give one of them");
      placed_splats const p = placed(r);
      vec3d scale(1.0);
      if (json const* const s = r.find("scale"); s && s->is_array())
        scale = three(r, "scale", scale);
      else
        scale = vec3d(number_within(r, "scale", 1, -1e9, 1e9));
      if (scale.x == 0 || scale.y == 0 || scale.z == 0) throw io_error(r.where, "'scale' is zero", "correct it");
      io::placing where{rotation_of(p.rotation), p.translation};
      for (int c = 0; c < 3; ++c) where.linear[c] *= scale[c];
      light::scene part = r.has("shape") ? shape_of(r, where) : mesh_of(r, where);
      if (r.has("name") && part.meshes.size() == 1) part.meshes[0].name = r.text("name");
      if (r.has("material")) {
        int const number = material_number(r.text("material"));
        if (number < 0) refuse_material(r);
        part.materials.clear(), part.textures.clear();
        for (light::mesh& m : part.meshes) m.triangle_material.clear();
        std::size_t const first = out_.scene.meshes.size();
        io::append(out_.scene, std::move(part));
        for (std::size_t i = first; i < out_.scene.meshes.size(); ++i)
          out_.scene.meshes[i].triangle_material.assign(out_.scene.meshes[i].triangles.size() / 3,
                                                        static_cast<u32>(number));
      } else {
        io::append(out_.scene, std::move(part));
      }
      out_.mesh_entries.resize(out_.scene.meshes.size(), entry++);
    });
  }

  [[noreturn]] void refuse_material(record const& r) const {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < named_; ++i) names.push_back(out_.scene.materials[i].name);
    throw io_error(r.where,
                   "'material' is '" + r.text("material").substr(0, 60) + "'" + did_you_mean(r.text("material"), names),
                   names.empty() ? "describe it in 'materials'" : "there are " + joined(names));
  }

  light::scene shape_of(record const& r, io::placing const& where) {
    std::string const shape = r.text("shape");
    std::vector<std::string> const names(std::begin(io::shape_names), std::end(io::shape_names));
    if (std::find(names.begin(), names.end(), shape) == names.end())
      throw io_error(r.where, "'shape' is '" + shape.substr(0, 60) + "'" + did_you_mean(shape, names),
                     "there are sphere, box, plane and torus");
    light::scene part;
    part.materials.emplace_back();
    part.materials[0].name = "default";
    io::raw_mesh raw = io::shape_named(shape);
    raw.name = r.has("name") ? r.text("name") : shape;
    io::add_placed(part, raw, {where * io::placing{turn_, none}, origin_}, r.where, out_.notes);
    io::require_meshes(part, r.where, out_.notes);
    return part;
  }

  light::scene mesh_of(record const& r, io::placing const& where) {
    fs::path const file = file_of(r, "file");
    std::string const ending = ending_of(file);
    if (is_gltf(file)) {
      auto parts = io::read_gltf_scene(file, {where * io::placing{turn_, none}, origin_}, out_.notes);
      for (named_camera& c : parts.cameras) out_.cameras.push_back(std::move(c));
      return std::move(parts.scene);
    }
    if (ending == ".obj") return io::read_obj_scene(file, {where, origin_}, out_.notes);
    if (ending == ".ply") return io::read_ply_scene(file, {where, origin_}, out_.notes);
    throw io_error(r.where, "'file' is '" + r.text("file").substr(0, 200) + "'",
                   "meshes are .glb, .gltf, .obj or .ply");
  }

  void read_lights() {
    each("lights", "light", [&](record const& r) {
      light::light l;
      l.kind = choice(r, "kind", l.kind);
      l.name = name_of(r);
      std::vector<std::string> keys{"name", "kind", "color"};
      auto const with = [&](std::initializer_list<char const*> more) {
        keys.insert(keys.end(), more.begin(), more.end());
      };
      using enum light::light_kind;
      if (l.kind == directional) with({"direction", "angle"});
      if (l.kind != directional) with({"position"});
      if (l.kind == sphere) with({"radius"});
      if (l.kind == rectangle) with({"edge_u", "edge_v"});
      if (r.own.is_object()) require_keys(r, keys);
      l.color = vec3(three(r, "color", vec3d(1.0), 0, 1e12));
      l.position = vec3(three(r, "position", none) - (l.kind == directional ? none : origin_));
      l.direction = vec3(three(r, "direction", -turn_[1], -1e6, 1e6));
      if (l.direction == vec3(0.0f))
        throw io_error(r.where, "'direction' is all zero", "write the way that its light goes");
      l.angle = static_cast<float>(number_within(r, "angle", 0, 0, 180) * std::numbers::pi / 360);
      l.radius = static_cast<float>(number_within(r, "radius", 1, 1e-9, 1e9));
      l.edge_u = vec3(three(r, "edge_u", turn_[0])), l.edge_v = vec3(three(r, "edge_v", turn_[2]));
      out_.scene.lights.push_back(l);
    });
  }

  void read_environment() {
    out_.scene.around.visible = top_.has("environment");
    if (!out_.scene.around.visible) return;
    record const r{top_.at("environment"), nullptr, top_.where + ": environment"};
    require_keys(r, {"file", "color", "degrees", "visible", "sky"});
    light::environment& e = out_.scene.around;
    if (r.has("file") && r.has("sky")) throw io_error(r.where, "has a 'file' and a 'sky'", "give one of them");
    e.color = vec3(three(r, "color", r.has("file") || r.has("sky") ? vec3d(1.0) : none, 0, 1e6));
    e.visible = flag(r, "visible", true);
    if (r.has("file")) {
      image_float image = read_radiance(file_of(r, "file"));
      e.width = image.width, e.height = image.height;
      e.texels.assign(image.data.begin(), image.data.end());
    } else if (r.has("sky")) {
      read_sky(record{r.at("sky"), nullptr, r.where + ", sky"}, e);
    }
    double const turned = number_within(r, "degrees", 0, -360, 360) * std::numbers::pi / 180, c = std::cos(turned),
                 s = std::sin(turned);
    mat3d about(1.0);  // -turned about y
    about[0] = vec3d(c, 0, s), about[2] = vec3d(-s, 0, c);
    mat3d back(1.0);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) back[i][j] = turn_[j][i];
    e.to_image = mat3(about * back);
  }

  // From the zenith through the horizon to the ground.
  static void read_sky(record const& r, light::environment& e) {
    require_keys(r, {"zenith", "horizon", "ground"});
    vec3d const zenith = three(r, "zenith", {0.25, 0.45, 0.9}, 0, 1e6),
                horizon = three(r, "horizon", {0.9, 0.95, 1.0}, 0, 1e6),
                ground = three(r, "ground", {0.3, 0.28, 0.25}, 0, 1e6);
    e.width = 4, e.height = 128;
    for (int y = 0; y < e.height; ++y) {
      double const up = std::cos(std::numbers::pi * (y + 0.5) / e.height);
      vec3d const v = up > 0 ? horizon + std::sqrt(up) * (zenith - horizon) : ground;
      for (int x = 0; x < e.width; ++x)
        for (int c = 0; c < 3; ++c) e.texels.push_back(static_cast<float>(v[c]));
    }
  }

  void read_cameras() {
    if (!top_.has("cameras")) return;
    json const& value = top_.at("cameras");
    if (value.is_string()) {
      for (named_camera& c : load_cameras(file_of(top_, "cameras"))) out_.cameras.push_back(std::move(c));
      return;
    }
    each("cameras", "camera", [&](record const& r) {
      named_camera c = parse_camera_json(r.own.dump(-1, ' ', false, json::error_handler_t::replace), r.where);
      if (c.name.empty()) c.name = "camera_" + std::to_string(out_.cameras.size());
      out_.cameras.push_back(std::move(c));
    });
    std::vector<std::string*> names;
    for (named_camera& c : out_.cameras) names.push_back(&c.name);
    io::make_file_names(names);
  }

  void read_options() {
    if (!top_.has("options")) return;
    record const r{top_.at("options"), nullptr, top_.where + ": options"};
    require_keys(r, {"samples", "bounces", "roulette_after", "seed", "shadows", "ambient", "relight", "linear",
                     "aperture", "focus", "blur", "jitter", "firefly", "exposure", "tone_map"});
    light::path_options& o = out_.paths;
    auto const whole = [&](char const* key, int& to) { to = static_cast<int>(number_within(r, key, to, 0, 1e6)); };
    auto const real = [&](char const* key, float& to, double least, double most) {
      to = static_cast<float>(number_within(r, key, static_cast<double>(to), least, most));
    };
    whole("samples", o.samples), whole("bounces", o.bounces), whole("roulette_after", o.roulette_after);
    o.seed = static_cast<u64>(number_within(r, "seed", 0, 0, 9e15));
    o.shadows = choice(r, "shadows", o.shadows), o.tone = choice(r, "tone_map", o.tone);
    o.relight = flag(r, "relight", o.relight), o.linear = flag(r, "linear", o.linear),
    o.jitter = flag(r, "jitter", o.jitter);
    real("ambient", o.ambient, 0, 1), real("aperture", o.aperture, 0, 1e9), real("focus", o.focus, 1e-9, 1e9);
    real("blur", o.blur, 0, 1e6), real("firefly", o.firefly, 0, 1e9), real("exposure", o.exposure, -30, 30);
  }

  fs::path path_;
  json root_;
  record top_;
  vec3d origin_{0.0};
  mat3d turn_{1.0};
  std::size_t named_ = SIZE_MAX;  // materials of the file itself
  scene_file out_;
};

}  // namespace

std::vector<placed_splats> read_scene_splats(fs::path const& path) {
  if (is_gltf(path)) {
    if (!io::gltf_contents_of(path).splats) return {};
    placed_splats all;
    all.file = path;
    return {all};
  }
  if (ending_of(path) != ".json") return {};
  return scene_reader(path).splats();
}

scene_file read_scene_text(std::string const& text, fs::path const& path, vec3d const& origin) {
  json root = json::parse(text, nullptr, false);
  if (root.is_discarded()) throw io_error(path.string(), "is not valid JSON", "correct it");
  return scene_reader(path, std::move(root)).read(origin);
}

scene_file read_scene(fs::path const& path, vec3d const& origin) {
  std::string const ending = ending_of(path);
  if (ending == ".json") return scene_reader(path).read(origin);
  scene_file out;
  if (is_gltf(path)) {
    auto const has = io::gltf_contents_of(path);
    auto parts = io::read_gltf_scene(path, {{io::turn_from_y({0, -1, 0}), none}, origin}, out.notes);
    if (!has.splats) io::require_meshes(parts.scene, path.string(), out.notes);
    out.scene = std::move(parts.scene), out.cameras = std::move(parts.cameras);
    std::vector<std::string*> names;
    for (named_camera& c : out.cameras) names.push_back(&c.name);
    io::make_file_names(names);
  } else if (ending == ".obj") {
    out.scene = io::read_obj_scene(path, {{}, origin}, out.notes);
  } else if (ending == ".ply") {
    out.scene = io::read_ply_scene(path, {{}, origin}, out.notes);
  } else {
    throw io_error(path.string(), "is no scene", "scenes are .json, .glb, .gltf, .obj and .ply files");
  }
  out.scene.around.visible = false;  // the background is
  return out;
}

}  // namespace gart
