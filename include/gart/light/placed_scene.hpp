#pragma once
/// \file
/// A scene in a policy's memory, as set and as it stands in the frame of a view. The tree over its triangles is built
/// when it is set, and refitted where the frame moves.

#include <gart/exec/buffer.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/light/surface.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace gart { inline namespace GART_ISA { namespace light_kernels {

struct place_triangles {
  float const* corners;  // [T][9], world
  vec3d frame;
  triangle* placed;
  box* boxes;
  GART_KERNEL void operator()(index_t i) const {
    triangle t;
    for (int c = 0; c < 3; ++c)
      for (int k = 0; k < 3; ++k)
        t.corner[c][k] =
            static_cast<float>(corners[std::size_t{9} * i + static_cast<std::size_t>(3 * c + k)] - frame[k]);
    placed[i] = t, boxes[i] = triangle_box(t);
  }
};

template <execution E>
class placed_scene {
 public:
  explicit placed_scene(E& exec)
      : exec_(&exec),
        corners_(exec),
        texels_(exec),
        around_texels_(exec),
        around_rows_(exec),
        around_columns_(exec),
        placed_(exec),
        boxes_(exec),
        tree_(exec),
        rows_(exec),
        materials_(exec),
        textures_(exec),
        lights_(exec),
        specular_(exec) {}

  // A scene that require_scene lets pass.
  void set(light::scene const& s) {
    set_meshes(s);
    set_materials(s);
    set_around(s.around);
    from_ = s.lights;
    catches_ = std::any_of(s.materials.begin(), s.materials.end(),
                           [](auto const& m) { return m.kind == light::material_kind::shadow_catcher; });
    if (specular_.size() == 0) specular_.assign(specular_albedos());
    is_placed_ = false;
  }

  scene_view const& stand_at(vec3d const& frame) {
    if (is_placed_ && frame == frame_) return view_;
    index_t const n = static_cast<index_t>(corners_.size() / 9);
    placed_.resize(n), boxes_.resize(n);
    parallel_for(*exec_, "light/place", n, place_triangles{corners_.data(), frame, placed_.data(), boxes_.data()});
    if (tree_.view().count == n && !is_new_)
      tree_.refit(*exec_, boxes_);
    else
      tree_.build(*exec_, boxes_);
    std::vector<light_row> rows;
    for (light::light const& l : from_) rows.push_back(row_of(l, frame));
    lights_.assign(rows);
    frame_ = frame, is_placed_ = true, is_new_ = false;
    view_.triangles = {tree_.view(), placed_.data()};
    view_.rows = rows_.data(), view_.materials = materials_.data(), view_.textures = textures_.data();
    view_.texels = texels_.data(), view_.lights = lights_.data();
    view_.light_count = static_cast<u32>(rows.size());
    view_.around = around_, view_.specular = specular_.data();
    return view_;
  }

  bool catches_shadows() const { return catches_; }
  index_t triangles() const { return static_cast<index_t>(corners_.size() / 9); }
  std::size_t lights() const { return from_.size(); }

 private:
  void set_meshes(light::scene const& s) {
    std::vector<float> corners;
    std::vector<triangle_row> rows;
    for (u32 m = 0; m < s.meshes.size(); ++m) {
      light::mesh const& mesh = s.meshes[m];
      for (std::size_t t = 0; t < mesh.triangles.size() / 3; ++t) {
        triangle_row row{};
        for (std::size_t c = 0; c < 3; ++c) {
          u32 const at = mesh.triangles[3 * t + c];
          for (int k = 0; k < 3; ++k) corners.push_back(mesh.positions[at][k]);
          row.normal[c] = mesh.normals.empty() ? vec3(0.0f) : mesh.normals[at];
          row.uv[c] = mesh.uvs.empty() ? vec2(0.0f) : mesh.uvs[at];
        }
        row.material = mesh.triangle_material.empty() ? 0 : mesh.triangle_material[t];
        row.mesh = m, row.number = static_cast<u32>(t);
        rows.push_back(row);
      }
    }
    corners_.assign(corners), rows_.assign(rows);
    is_new_ = true;
  }
  void set_materials(light::scene const& s) {
    std::vector<material_row> rows;
    for (light::material const& m : s.materials)
      rows.push_back({m.kind, m.base_color, m.emission, m.metallic, m.roughness, m.ior, m.opacity, m.cutout,
                      m.base_color_texture, m.metallic_roughness_texture, m.emission_texture, m.normal_texture});
    std::vector<texture_row> textures;
    std::vector<float> texels;
    for (light::texture const& t : s.textures) {
      textures.push_back({texels.size() / 4, t.width, t.height, t.repeat_u, t.repeat_v});
      texels.insert(texels.end(), t.texels.begin(), t.texels.end());
    }
    materials_.assign(rows), textures_.assign(textures), texels_.assign(texels);
  }
  // Its brightness a texel, summed up, by which directions are drawn.
  void set_around(light::environment const& e) {
    around_ = {};
    around_.color = e.color, around_.to_image = e.to_image;
    around_.visible = e.visible && (e.width > 0 || e.color != vec3(0.0f));
    if (e.width == 0) return;
    std::size_t const w = static_cast<std::size_t>(e.width), h = static_cast<std::size_t>(e.height);
    std::vector<double> of_rows(h + 1, 0.0);
    std::vector<float> columns(h * (w + 1)), rows(h + 1);
    std::vector<double> sums(w + 1);
    for (std::size_t y = 0; y < h; ++y) {
      double const sine = std::sin(3.141592653589793 * (static_cast<double>(y) + 0.5) / static_cast<double>(h));
      for (std::size_t x = 0; x < w; ++x) {
        float const* const t = e.texels.data() + 3 * (y * w + x);
        sums[x + 1] = sums[x] + double{luminance(vec3(t[0], t[1], t[2]))};
      }
      for (std::size_t x = 0; x <= w; ++x)
        columns[y * (w + 1) + x] =
            static_cast<float>(sums[w] > 0 ? sums[x] / sums[w] : static_cast<double>(x) / static_cast<double>(w));
      of_rows[y + 1] = of_rows[y] + sums[w] * sine;
    }
    if (!(of_rows[h] > 0)) {  // an image of no light
      around_.color = vec3(0.0f), around_.visible = e.visible;
      return;
    }
    for (std::size_t y = 0; y <= h; ++y) rows[y] = static_cast<float>(of_rows[y] / of_rows[h]);
    around_texels_.assign(e.texels), around_rows_.assign(rows), around_columns_.assign(columns);
    around_.width = e.width, around_.height = e.height;
    around_.texels = around_texels_.data(), around_.rows = around_rows_.data();
    around_.columns = around_columns_.data();
  }
  static light_row row_of(light::light const& l, vec3d const& frame) {
    light_row row{};
    row.kind = l.kind, row.color = l.color;
    for (int k = 0; k < 3; ++k) row.position[k] = static_cast<float>(l.position[k] - frame[k]);
    if (l.kind == light::light_kind::directional) {
      row.direction = unit(l.direction);
      float const half = std::sin(0.5f * l.angle);
      row.rise = 2 * half * half;
      float const sine = std::sin(l.angle);
      if (row.rise > 0) row.color /= pi * sine * sine;  // the irradiance is over the disk
    }
    if (l.kind == light::light_kind::sphere) row.radius = l.radius;
    if (l.kind == light::light_kind::rectangle) {
      row.edge_u = l.edge_u, row.edge_v = l.edge_v;
      vec3 const across = glm::cross(l.edge_u, l.edge_v);
      row.area = glm::length(across), row.normal = across / row.area;
    }
    return row;
  }

  E* exec_;
  std::vector<light::light> from_;
  buffer<float, E> corners_, texels_, around_texels_, around_rows_, around_columns_;
  buffer<triangle, E> placed_;
  buffer<box, E> boxes_;
  bvh<E> tree_;
  buffer<triangle_row, E> rows_;
  buffer<material_row, E> materials_;
  buffer<texture_row, E> textures_;
  buffer<light_row, E> lights_;
  buffer<vec2, E> specular_;
  environment_view around_;
  scene_view view_;
  vec3d frame_{0.0};
  bool is_placed_ = false, is_new_ = true, catches_ = false;
};

}}}  // namespace gart::GART_ISA::light_kernels
