#include <gart/core/error.hpp>
#include <gart/core/words.hpp>
#include <gart/io/file.hpp>
#include <gart/scene/similarity.hpp>
#include <gart/view/edited_scene.hpp>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace gart {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr char const* own = "own";
constexpr float light_distance = 0.6f;  // of the extent, from the middle: where a light's handle is that stands nowhere

json list_of(vec3d const& v) { return {v.x, v.y, v.z}; }
vec3d three(json const& object, char const* key, vec3d const& otherwise) {
  auto const it = object.find(key);
  if (it == object.end() || !it->is_array() || it->size() != 3) return otherwise;
  return {(*it)[0].get<double>(), (*it)[1].get<double>(), (*it)[2].get<double>()};
}
std::array<double, 4> rotation_in(json const& mesh) {
  auto const it = mesh.find("rotation");
  return it == mesh.end() ? std::array<double, 4>{1, 0, 0, 0} : it->get<std::array<double, 4>>();
}
vec3d scale_in(json const& mesh) {
  auto const it = mesh.find("scale");
  return it == mesh.end() || it->is_array() ? three(mesh, "scale", vec3d(1.0)) : vec3d(it->get<double>());
}
mat3d linear_of(json const& mesh) {
  mat3d out = rotation_of(rotation_in(mesh));
  for (int c = 0; c < 3; ++c) out[c] *= scale_in(mesh)[c];
  return out;
}
std::string text_of(json const& object, char const* key) {
  auto const it = object.find(key);
  return it != object.end() && it->is_string() ? it->get<std::string>() : std::string();
}
std::size_t size_of(json const& document, char const* list) {
  auto const it = document.find(list);
  return it != document.end() && it->is_array() ? it->size() : 0;
}

bool has_ending(fs::path const& file, std::initializer_list<char const*> endings) {
  return std::find(endings.begin(), endings.end(), lower(file.extension().string())) != endings.end();
}

}  // namespace

struct edited_scene::state {
  fs::path path;  // of a scene.json that there may not be: its folder counts
  vec3d origin;
  vec3 middle;
  float extent;
  json document;
  scene_file now;
  std::vector<json> materials;                             // of the meshes, as the file says: a name or null
  std::vector<std::pair<std::string, std::string>> names;  // files that were added, and their names

  std::size_t meshes() const { return size_of(document, "meshes"); }
  // Lights of mesh files come before those of the scene's own list.
  std::size_t first_light() const { return now.scene.lights.size() - size_of(document, "lights"); }

  void read_again(json const& changed) {
    scene_file next = read_scene_text(changed.dump(-1, ' ', false, json::error_handler_t::replace), path, origin);
    light::require_scene(next.scene);
    now = std::move(next), document = changed;
  }

  std::string material_of_kind(json& changed, std::string const& kind) const {
    for (std::string name = kind;; name += "_") {
      json* same = nullptr;
      for (json& m : changed["materials"])
        if (text_of(m, "name") == name) same = &m;
      if (!same) {
        changed["materials"].push_back({{"name", name}, {"kind", kind}});
        return name;
      }
      if (*same == json{{"name", name}, {"kind", kind}}) return name;
    }
  }

  view_part mesh_part(std::size_t i) const {
    json const& entry = document["meshes"][i];
    view_part out;
    out.name = text_of(entry, "name");
    if (out.name.empty()) out.name = fs::path(text_of(entry, "file")).stem().string();
    if (out.name.empty()) out.name = text_of(entry, "shape");
    out.kind = own;
    if (entry.value("material", json()) != materials[i])
      for (json const& m : document["materials"])
        if (text_of(m, "name") == text_of(entry, "material")) out.kind = text_of(m, "kind");
    out.low = vec3(std::numeric_limits<float>::max()), out.high = -out.low;
    for (std::size_t k = 0; k < now.scene.meshes.size(); ++k)
      if (now.mesh_entries[k] == static_cast<int>(i))
        for (vec3 const& p : now.scene.meshes[k].positions)
          out.low = glm::min(out.low, p), out.high = glm::max(out.high, p);
    if (!(out.low.x <= out.high.x)) out.low = out.high = vec3(0.0f);
    out.place = 0.5f * (out.low + out.high);
    out.rotation = rotation_in(entry), out.scale = scale_in(entry);
    return out;
  }
  view_part light_part(std::size_t i) const {
    light::light const& l = now.scene.lights[first_light() + i];
    view_part out;
    out.light = true, out.kind = to_string(l.kind), out.color = l.color;
    out.name = l.name.empty() ? "light " + std::to_string(i + 1) : l.name;
    out.place = l.kind == light::light_kind::directional
                    ? middle - light_distance * extent * l.direction / std::sqrt(glm::dot(l.direction, l.direction))
                    : l.position;
    return out;
  }

  void change_mesh(std::size_t i, part_edit const& edit) {
    json changed = document;
    json& entry = changed["meshes"][i];
    if (edit.place || edit.rotation || edit.scale) {
      vec3 const stood = mesh_part(i).place, stands = edit.place.value_or(stood);
      mat3d const before = linear_of(entry);
      if (edit.rotation) entry["rotation"] = *edit.rotation;
      if (edit.scale) entry["scale"] = list_of(*edit.scale);
      bool const turns = edit.rotation || edit.scale;
      mat3d const linear = turns ? linear_of(entry) * glm::inverse(before) : mat3d(1.0);
      vec3d const by(stands - stood), about(edit.about.value_or(stands));
      auto const moved = [&](vec3d const& p) { return turns ? linear * (p + by - about) + about : p + by; };
      vec3d const at = three(entry, "translation", vec3d(0.0));
      entry["translation"] = list_of(turns ? moved(at - origin) + origin : at + by);
      // Else lights of its file would move with it, or triangles show their other side.
      bool const alone = first_light() == 0 && glm::determinant(linear) > 0;
      if (alone && !edit.material) {
        mat3d const of_normals = glm::transpose(glm::inverse(linear));
        for (std::size_t k = 0; k < now.scene.meshes.size(); ++k) {
          if (now.mesh_entries[k] != static_cast<int>(i)) continue;
          for (vec3& p : now.scene.meshes[k].positions) p = vec3(moved(vec3d(p)));
          if (!turns) continue;
          for (vec3& n : now.scene.meshes[k].normals)
            if (n != vec3(0.0f)) n = vec3(glm::normalize(of_normals * vec3d(n)));
        }
        document = std::move(changed);
        return;
      }
    }
    if (edit.material) {
      if (*edit.material != own)
        entry["material"] = material_of_kind(changed, *edit.material);
      else if (materials[i].is_null())
        entry.erase("material");
      else
        entry["material"] = materials[i];
    }
    read_again(changed);
  }
  void change_light(std::size_t i, part_edit const& edit) {
    json& entry = document["lights"][i];
    light::light& l = now.scene.lights[first_light() + i];
    if (edit.color) l.color = *edit.color, entry["color"] = list_of(vec3d(*edit.color));
    if (!edit.place) return;
    if (l.kind != light::light_kind::directional) {
      l.position = *edit.place, entry["position"] = list_of(vec3d(*edit.place) + origin);
    } else if (vec3 const way = middle - *edit.place; glm::dot(way, way) > 0) {
      l.direction = way, entry["direction"] = list_of(vec3d(way));
    }
  }
};

edited_scene::edited_scene(fs::path const& file, scene_file read, vec3d const& origin, fs::path const& model,
                           vec3 const& middle, float extent)
    : state_(std::make_unique<state>()) {
  state& s = *state_;
  bool const is_scene = has_ending(file, {".json"});
  s.path = is_scene ? file : file.parent_path() / "scene.json";
  s.origin = origin, s.middle = middle, s.extent = extent > 0 ? extent : 1, s.now = std::move(read);
  if (is_scene) {
    std::vector<u8> const bytes = read_file(file);
    s.document = json::parse(bytes.begin(), bytes.end(), nullptr, false);
    if (!s.document.is_object())
      throw io_error(file.string(), "is read, but is not JSON by the letter", "write numbers in place of NaN and such");
  } else {
    s.document = json::object();
    if (!read_scene_splats(file).empty()) s.document["models"] = json::array({{{"file", file.filename().string()}}});
    if (!s.now.scene.meshes.empty()) s.document["meshes"] = json::array({{{"file", file.filename().string()}}});
    s.now.mesh_entries.assign(s.now.scene.meshes.size(), 0);
  }
  if (!model.empty()) {
    json& models = s.document["models"];
    if (!models.is_array()) models = json::array();
    fs::path const from = s.path.has_parent_path() ? s.path.parent_path() : fs::path(".");
    models.insert(models.begin(), json{{"file", fs::proximate(model, from).generic_string()}});
  }
  if (!s.document.contains("materials")) s.document["materials"] = json::array();
  for (std::size_t i = 0; i < s.meshes(); ++i) s.materials.push_back(s.document["meshes"][i].value("material", json()));
}
edited_scene::~edited_scene() = default;

light::scene const& edited_scene::scene() const { return state_->now.scene; }

std::vector<view_part> edited_scene::parts() const {
  std::vector<view_part> all;
  for (std::size_t i = 0; i < state_->meshes(); ++i) all.push_back(state_->mesh_part(i));
  for (std::size_t i = 0; i < size_of(state_->document, "lights"); ++i) all.push_back(state_->light_part(i));
  return all;
}

void edited_scene::change(part_edit const& edit) {
  state& s = *state_;
  std::size_t const i = static_cast<std::size_t>(edit.index), meshes = s.meshes();
  if (edit.index < 0 || i >= meshes + size_of(s.document, "lights"))
    throw invalid_argument("part_edit.index: there is no part " + std::to_string(edit.index));
  if (i < meshes)
    s.change_mesh(i, edit);
  else
    s.change_light(i - meshes, edit);
}

void edited_scene::add(fs::path const& file, std::string const& name) {
  state& s = *state_;
  json changed = s.document;
  std::string const at = fs::absolute(file).string();
  bool const around = has_ending(file, {".hdr", ".exr"});
  if (around)
    changed["environment"] = {{"file", at}};
  else
    changed["meshes"].push_back({{"name", fs::path(name).stem().string()}, {"file", at}});
  s.read_again(changed);
  if (!around) s.materials.emplace_back();
  s.names.emplace_back(at, name);
}

std::string edited_scene::text() const {
  json out = state_->document;
  auto const rename = [&](json& object) {
    for (auto const& [at, name] : state_->names)
      if (text_of(object, "file") == at) object["file"] = name;
  };
  if (out.contains("meshes"))
    for (json& entry : out["meshes"]) rename(entry);
  if (out.contains("environment")) rename(out["environment"]);
  if (out["materials"].empty()) out.erase("materials");
  return out.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

}  // namespace gart
