// Wavefront OBJ and its MTL (http://paulbourke.net/dataformats/obj, .../mtl), and meshes of PLY. Of an MTL: Kd, Ke, Ns,
// Ni, d or Tr, illum, Pr, Pm and the maps map_Kd, map_Ke and norm. Curves, lines and points are left out. The library
// tinyobjloader 2.0 would not do: it reads what is no number as 0, and corner 2^32 + 1 as corner 1.

#include "codec.hpp"
#include "scene_parts.hpp"
#include "text_lines.hpp"
#include "unusable.hpp"

#include <gart/io/image_file.hpp>
#include <gart/io/mesh_file.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

namespace gart::io {
namespace {

namespace fs = std::filesystem;

class obj_reader {
 public:
  obj_reader(fs::path const& path, mesh_place const& place, std::vector<std::string>& notes)
      : path_(path), place_(place), notes_(notes), lines_(path) {}

  light::scene read() {
    std::size_t left_out = 0;
    while (lines_.next_record()) {
      std::string const key(lines_.word("a record"));
      if (key == "v")
        position_.push_back(three());
      else if (key == "vn")
        normal_.push_back(vec3(three()));
      else if (key == "vt")
        uv_.push_back({lines_.number<float>("u"), 1 - lines_.number<float>("v")});  // v goes up in an OBJ
      else if (key == "f")
        read_face();
      else if (key == "o" || key == "g")
        begin_mesh(lines_.is_blank() ? "" : lines_.rest_of_line("a name"));
      else if (key == "usemtl")
        material_ = material_named(lines_.rest_of_line("the material"));
      else if (key == "mtllib")
        read_materials(lines_.rest_of_line("the file of materials"));
      else if (key != "s")
        ++left_out;
    }
    begin_mesh("");
    require_meshes(out_, path_.string(), notes_);
    if (left_out) notes_.push_back(counted(left_out, "record") + " of " + path_.string() + " left out: no faces");
    return std::move(out_);
  }

 private:
  vec3d three() {
    vec3d p;
    for (int k = 0; k < 3; ++k) p[k] = lines_.number<double>("a coordinate");
    return p;
  }

  // "7", "7/1", "7//3", "7/1/3": places from 1 on, or back from the last.
  void read_face() {
    std::vector<u32> corners;
    for (std::string text; !lines_.is_blank();) {
      text = lines_.word("a corner");
      std::array<std::ptrdiff_t, 3> at{-1, -1, -1};
      std::string_view rest = text;
      std::size_t const many[] = {position_.size(), uv_.size(), normal_.size()};
      static constexpr char const* nouns[] = {"vertex", "texture coordinate", "normal"};
      for (std::size_t k = 0; k < 3 && !rest.empty(); ++k) {
        std::string_view const part = rest.substr(0, rest.find('/'));
        rest.remove_prefix(std::min(rest.size(), part.size() + 1));
        if (part.empty() && k > 0) continue;
        std::int64_t number = 0;
        if (!parse_number(part, number) || number == 0 || std::abs(number) > static_cast<std::int64_t>(many[k]))
          lines_.refuse("a face has the " + std::string(nouns[k]) + " '" + std::string(part.substr(0, 40)) +
                        "', and there are " + std::to_string(many[k]) + " before it");
        at[k] = number > 0 ? number - 1 : static_cast<std::ptrdiff_t>(many[k]) + number;
      }
      if (at[0] < 0) lines_.refuse("a corner of a face is '" + text.substr(0, 40) + "'");
      corners.push_back(vertex(at));
    }
    if (corners.size() < 3) lines_.refuse("a face has " + std::to_string(corners.size()) + " corners");
    if (!material_) material_ = material_named("");
    for (std::size_t i = 2; i < corners.size(); ++i) {
      raw_.triangle.push_back({corners[0], corners[i - 1], corners[i]});
      raw_.material.push_back(*material_);
    }
  }

  // Of the mesh; the same for the same three numbers.
  u32 vertex(std::array<std::ptrdiff_t, 3> const& at) {
    auto const [known, is_new] = vertices_.try_emplace(at, static_cast<u32>(raw_.position.size()));
    if (!is_new) return known->second;
    raw_.position.push_back(position_[static_cast<std::size_t>(at[0])]);
    raw_.uv.push_back(at[1] < 0 ? vec2(0.0f) : uv_[static_cast<std::size_t>(at[1])]);
    raw_.normal.push_back(at[2] < 0 ? vec3(0.0f) : normal_[static_cast<std::size_t>(at[2])]);
    has_uv_ = has_uv_ || at[1] >= 0, lacks_normal_ = lacks_normal_ || at[2] < 0;
    return known->second;
  }

  void begin_mesh(std::string name) {
    if (!has_uv_) raw_.uv.clear();
    if (lacks_normal_) raw_.normal.clear();
    if (!raw_.triangle.empty()) add_placed(out_, raw_, place_, path_.string(), notes_);
    raw_ = {}, vertices_.clear(), has_uv_ = lacks_normal_ = false;
    raw_.name = std::move(name);
  }

  u32 material_named(std::string const& name) {
    auto const [known, is_new] = numbers_.try_emplace(name, static_cast<u32>(out_.materials.size()));
    if (is_new) {
      out_.materials.emplace_back();
      out_.materials.back().name = name.empty() ? "default" : name;
      if (!name.empty())
        notes_.push_back("the material '" + name.substr(0, 60) + "' of " + path_.string() + " is in no MTL");
    }
    return known->second;
  }

  void read_materials(std::string const& name) {
    fs::path const file = path_.parent_path() / name;
    if (!fs::is_regular_file(file))
      throw io_error(path_.string(), "mtllib '" + name.substr(0, 200) + "' is not there",
                     "put it beside the OBJ, or remove the line");
    text_lines in(file);
    light::material* m = nullptr;
    bool glass = false;
    while (in.next_record()) {
      std::string const key(in.word("a record"));
      if (key == "newmtl") {
        std::string const called = in.rest_of_line("a name");
        if (!numbers_.try_emplace(called, static_cast<u32>(out_.materials.size())).second)
          in.refuse("two materials are called '" + called.substr(0, 60) + "'", "rename one");
        out_.materials.emplace_back(), m = &out_.materials.back(), m->name = called, glass = false;
        continue;
      }
      if (!m) in.refuse("a field comes before the first 'newmtl'");
      auto const number = [&](float least, float most) {
        auto const v = in.number<float>(key.c_str());
        if (!(v >= least && v <= most))
          in.refuse("'" + key + "' is " + std::to_string(v) + ", not between " + std::to_string(least) + " and " +
                        std::to_string(most),
                    "correct it");
        return v;
      };
      if (key == "Kd" || key == "Ke") {
        bool const shines = key == "Ke";
        for (int c = 0; c < 3; ++c) (shines ? m->emission : m->base_color)[c] = number(0, shines ? 1e9f : 1);
      } else if (key == "Ns") {
        m->roughness = std::sqrt(std::sqrt(2 / (number(0, 1e6f) + 2)));  // of Blinn and Phong's exponent
      } else if (key == "Ni") {
        m->ior = std::max(1.0f, number(0, 10));
      } else if (key == "d") {
        m->opacity = number(0, 1);
      } else if (key == "Tr") {
        m->opacity = 1 - number(0, 1);
      } else if (key == "Pr") {
        m->roughness = number(0, 1);
      } else if (key == "Pm") {
        m->metallic = number(0, 1);
      } else if (key == "illum") {
        float const model = number(0, 10);
        glass = model == 4 || model == 6 || model == 7 || model == 9;
      } else if (key == "map_Kd") {
        m->base_color_texture = texture_at(in, file, true);
      } else if (key == "map_Ke") {
        m->emission_texture = texture_at(in, file, true);
      } else if (key == "norm") {
        m->normal_texture = texture_at(in, file, false);
      }
      if (glass) m->kind = light::material_kind::dielectric, m->opacity = 1;
    }
  }

  int texture_at(text_lines& in, fs::path const& mtl, bool colours) {
    std::string const name = in.rest_of_line("a file");
    if (name.starts_with('-')) in.refuse("a map has the option '" + name.substr(0, 40) + "'", "name the file alone");
    fs::path const file = mtl.parent_path() / name;
    if (!fs::is_regular_file(file))
      in.refuse("the texture '" + name.substr(0, 200) + "' is not there", "put it beside the MTL");
    out_.textures.push_back(texture_of(read_image(file), colours, name));
    return static_cast<int>(out_.textures.size()) - 1;
  }

  fs::path path_;
  mesh_place place_;
  std::vector<std::string>& notes_;
  text_lines lines_;
  std::vector<vec3d> position_;
  std::vector<vec3> normal_;
  std::vector<vec2> uv_;
  raw_mesh raw_;
  std::map<std::array<std::ptrdiff_t, 3>, u32> vertices_;
  bool has_uv_ = false, lacks_normal_ = false;
  std::map<std::string, u32> numbers_;
  std::optional<u32> material_;
  light::scene out_;
};

}  // namespace

light::scene read_obj_scene(fs::path const& path, mesh_place const& place, std::vector<std::string>& notes) {
  return obj_reader(path, place, notes).read();
}

light::scene read_ply_scene(fs::path const& path, mesh_place const& place, std::vector<std::string>& notes) {
  triangle_mesh mesh = read_mesh_ply(path);
  raw_mesh raw;
  for (vec3 const& p : mesh.position) raw.position.push_back(vec3d(p));
  raw.triangle = std::move(mesh.triangle);
  raw.material.assign(raw.triangle.size(), 0);
  light::scene out;
  out.materials.emplace_back();
  out.materials[0].name = "default";
  add_placed(out, raw, place, path.string(), notes);
  require_meshes(out, path.string(), notes);
  return out;
}

}  // namespace gart::io
