#pragma once
// Light by definition, in double: a path through all Gaussians and all triangles, one by one. For scenes where no
// number decides at random: mirrors, glass that reflects nothing, surfaces lit by points and suns that see nothing
// else. It shares no code with the library.

#include <gart/light/path_options.hpp>
#include <gart/light/scene.hpp>
#include <gart/render/options.hpp>

#include <rays/double_rays.hpp>

namespace gart_test {

namespace light = gart::light;
using gart::vec3d;

class double_light {
 public:
  double_light(gart::gaussian_model const& model, light::scene const& scene, gart::render_options const& options,
               light::path_options const& paths)
      : m_(model), scene_(scene), options_(options), paths_(paths), factors_(m_.count, vec3d(1.0)) {
    if (paths.shadows == light::shadow_kind::per_gaussian)
      for (std::size_t i = 0; i < m_.count; ++i)
        factors_[i] = darkened({m_.mean[3 * i], m_.mean[3 * i + 1], m_.mean[3 * i + 2]}, vec3d(0.0), paths.relight);
  }

  vec3d operator()(vec3d o, vec3d d) const {
    vec3d seen(0.0), left(1.0);
    double near = double{options_.near};
    int bounces = 0;
    for (int step = 0; step < 40; ++step) {
      surface const s = nearest(o, d, near);
      auto const [color, transmittance] = gaussians(o, d, near, s.t);
      seen += left * color, left *= transmittance;
      if (!s.there()) {
        bool const around = scene_.around.visible && scene_.around.color != gart::vec3(0.0f);
        return seen + left * vec3d(around ? scene_.around.color : options_.background);
      }
      vec3d const at = o + s.t * d;
      light::material const& m = *s.material;
      if (m.kind == light::material_kind::shadow_catcher) {
        left *= darkened(at - 1e-7 * d, s.normal, false), near = s.t;
        continue;
      }
      seen += left * vec3d(m.emission) * s.texture(scene_, m.emission_texture);
      if (bounces++ == paths_.bounces) return seen;
      vec3d const base = vec3d(m.base_color) * s.texture(scene_, m.base_color_texture);
      vec3d const n = glm::dot(s.normal, d) < 0 ? s.normal : -s.normal;
      if (m.kind == light::material_kind::mirror) {
        d = d - 2 * glm::dot(d, n) * n, left *= base;
      } else if (m.kind == light::material_kind::dielectric) {
        double const ratio = glm::dot(s.normal, d) < 0 ? 1 / double{m.ior} : double{m.ior}, c = -glm::dot(d, n);
        double const rest = 1 - ratio * ratio * (1 - c * c);
        if (rest < 0)
          d = d - 2 * glm::dot(d, n) * n;
        else
          d = ratio * d + (ratio * c - std::sqrt(rest)) * n, left *= base;
      } else {
        for (light::light const& l : scene_.lights) {
          auto const [way, far, irradiance] = given(l, at);
          double const cosine = glm::dot(n, way);
          if (cosine <= 0 || blocked(at, way, far)) continue;
          seen += left * base * irradiance * (cosine / pi) * gaussians(at, way, 0, far).second;
        }
        return seen;  // what it sees else is black
      }
      o = at, near = 1e-7;
    }
    return seen;
  }

 private:
  static constexpr double pi = 3.141592653589793;
  struct surface {
    double t = HUGE_VAL, u = 0, v = 0;
    vec3d normal{0.0};
    light::material const* material = nullptr;
    light::mesh const* mesh = nullptr;
    std::size_t triangle = 0;
    bool there() const { return material != nullptr; }
    // The nearest texels by their distance from the point, in both directions.
    vec3d texture(light::scene const& scene, int number) const {
      if (number < 0) return vec3d(1.0);
      light::texture const& t = scene.textures[static_cast<std::size_t>(number)];
      vec3d sum(0.0);
      double x = 0, y = 0;
      for (int c = 0; c < 3; ++c) {
        auto const& uv = mesh->uvs[mesh->triangles[3 * triangle + static_cast<std::size_t>(c)]];
        double const weight = c == 0 ? 1 - u - v : c == 1 ? u : v;
        x += weight * double{uv.x} * t.width, y += weight * double{uv.y} * t.height;
      }
      for (int j = -2; j < t.height + 2; ++j)
        for (int i = -2; i < t.width + 2; ++i) {
          double const near_x = 1 - std::fabs(x - i - 0.5), near_y = 1 - std::fabs(y - j - 0.5);
          if (near_x <= 0 || near_y <= 0) continue;
          std::size_t const at =
              4 * static_cast<std::size_t>((j + t.height) % t.height * t.width + (i + t.width) % t.width);
          sum += near_x * near_y * vec3d(t.texels[at], t.texels[at + 1], t.texels[at + 2]);
        }
      return sum;
    }
  };
  struct gift {
    vec3d way;
    double far;
    vec3d irradiance;
  };

  template <class F>
  void each_triangle(vec3d const& o, vec3d const& d, F&& f) const {
    for (light::mesh const& mesh : scene_.meshes)
      for (std::size_t t = 0; t < mesh.triangles.size() / 3; ++t) {
        auto const corner = [&](std::size_t c) { return vec3d(mesh.positions[mesh.triangles[3 * t + c]]); };
        vec3d const a = corner(0), e = corner(1) - a, g = corner(2) - a, p = glm::cross(d, g), q = glm::cross(o - a, e);
        double const det = glm::dot(e, p), u = glm::dot(o - a, p) / det, v = glm::dot(d, q) / det;
        if (det == 0 || u < 0 || v < 0 || u + v > 1) continue;
        std::size_t const material = mesh.triangle_material.empty() ? 0 : mesh.triangle_material[t];
        f(surface{glm::dot(g, q) / det, u, v, glm::normalize(glm::cross(e, g)), &scene_.materials[material], &mesh, t});
      }
  }
  surface nearest(vec3d const& o, vec3d const& d, double near) const {
    surface out;
    each_triangle(o, d, [&](surface const& s) {
      if (s.t > near && s.t < out.t) out = s;
    });
    return out;
  }
  bool blocked(vec3d const& o, vec3d const& d, double far) const {
    bool any = false;
    each_triangle(o, d, [&](surface const& s) {
      any |= s.t > 1e-6 && s.t < far && s.material->kind != light::material_kind::shadow_catcher;
    });
    return any;
  }
  static gift given(light::light const& l, vec3d const& at) {
    if (l.kind == light::light_kind::directional)
      return {-glm::normalize(vec3d(l.direction)), HUGE_VAL, vec3d(l.color)};
    vec3d const way = vec3d(l.position) - at;
    double const d = glm::length(way);
    return {way / d, d, vec3d(l.color) / (d * d)};
  }
  // What is left of a colour at a point where lights are shadowed, or the light itself.
  vec3d darkened(vec3d const& at, vec3d const& n, bool relight) const {
    vec3d all(0.0), lit(0.0);
    for (light::light const& l : scene_.lights) {
      auto [way, far, irradiance] = given(l, at);
      if (n != vec3d(0.0)) irradiance *= std::fabs(glm::dot(n, way));
      all += irradiance;
      if (!blocked(at, way, far)) lit += irradiance;
    }
    double const ambient = double{paths_.ambient};
    vec3d out = ambient * all + (1 - ambient) * lit;
    for (int k = 0; k < 3; ++k) out[k] = relight ? out[k] / pi : all[k] > 0 ? out[k] / all[k] : 1;
    return out;
  }

  std::pair<vec3d, double> gaussians(vec3d const& o, vec3d const& d, double near, double far) const {
    struct hit {
      double t, alpha;
      std::size_t id;
      bool operator<(hit const& other) const { return t < other.t; }
    };
    std::vector<hit> hits;
    for (std::size_t i = 0; i < m_.count; ++i) {
      double q[4], norm = 0;
      for (std::size_t k = 0; k < 4; ++k) q[k] = m_.quaternion[4 * i + k], norm += q[k] * q[k];
      for (double& x : q) x /= std::sqrt(norm);
      double const w = q[0], x = q[1], y = q[2], z = q[3];
      vec3d const axes[3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
                             {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
                             {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
      vec3d og, dg;
      vec3d const from = o - vec3d(m_.mean[3 * i], m_.mean[3 * i + 1], m_.mean[3 * i + 2]);
      for (int k = 0; k < 3; ++k) {
        double const inverse = std::exp(-m_.log_scale[3 * i + static_cast<std::size_t>(k)]);
        og[k] = inverse * glm::dot(axes[k], from), dg[k] = inverse * glm::dot(axes[k], d);
      }
      double const t = -glm::dot(og, dg) / glm::dot(dg, dg);
      vec3d const p = og + t * dg;
      double const alpha = std::exp(-0.5 * glm::dot(p, p)) / (1 + std::exp(-m_.opacity[i]));
      if (alpha >= double{options_.alpha_min} && t > near && t <= far) hits.push_back({t, std::min(alpha, 0.99), i});
    }
    std::sort(hits.begin(), hits.end());
    double const direction[3] = {d.x, d.y, d.z};
    double basis[16];
    harmonics(direction, basis);
    vec3d sum(0.0);
    double left = 1;
    for (hit const& h : hits) {
      bool const relight = paths_.relight && paths_.shadows != light::shadow_kind::none;
      vec3d c(0.5);
      for (std::size_t k = 0; k < (relight ? 1 : m_.bands); ++k)
        for (std::size_t j = 0; j < 3; ++j) c[static_cast<int>(j)] += basis[k] * m_.sh[3 * (m_.bands * h.id + k) + j];
      for (int k = 0; k < 3; ++k) {
        c[k] = std::max(c[k], 0.0);
        if (paths_.linear) c[k] = c[k] <= 0.04045 ? c[k] / 12.92 : std::pow((c[k] + 0.055) / 1.055, 2.4);
      }
      if (paths_.shadows == light::shadow_kind::per_hit)
        c *= darkened(o + h.t * d, vec3d(0.0), paths_.relight);
      else
        c *= factors_[h.id];
      sum += left * h.alpha * c, left *= 1 - h.alpha;
    }
    return {sum, left};
  }

  double_model m_;
  light::scene scene_;
  gart::render_options options_;
  light::path_options paths_;
  std::vector<vec3d> factors_;
};

}  // namespace gart_test
