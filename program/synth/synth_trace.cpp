#include "synth_trace.hpp"

#include <gart/math/srgb.hpp>

#include "synth_embree.hpp"
#include "synth_random.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <thread>

namespace gart_cli {
namespace {

using gart::u8;

constexpr float pi = std::numbers::pi_v<float>;
constexpr float offset = 2e-4f;   // where rays leave a surface: above rounding, below the thinnest wire
constexpr int path_vertices = 2;  // surfaces on a path
constexpr int most_mirrors = 8;   // on the way to a surface
constexpr float glow = 0.28f;     // even light that stands for the paths' further bounces
constexpr float exposure = 0.88f;
constexpr float brightest = 6.0f;  // of one sample, so that a rare highlight stays a highlight and no firefly

struct frame {
  vec3 x, y, z;
  // T. Duff et al., "Building an Orthonormal Basis, Revisited", JCGT 2017.
  explicit frame(vec3 n) : z(n) {
    float const sign = std::copysign(1.0f, n.z), a = -1 / (sign + n.z), b = n.x * n.y * a;
    x = vec3(1 + sign * n.x * n.x * a, sign * b, -sign * n.x);
    y = vec3(b, sign + n.y * n.y * a, -n.y);
  }
  vec3 to_world(vec3 v) const { return x * v.x + y * v.y + z * v.z; }
  vec3 to_local(vec3 v) const { return {glm::dot(x, v), glm::dot(y, v), glm::dot(z, v)}; }
};

// A disc that faces the origin.
struct lamp {
  vec3 center{2.3f, -1.9f, 3.4f};
  float radius = 0.95f;
  vec3 radiance{25.0f, 23.2f, 20.5f};
  frame axes{glm::normalize(-center)};
};

vec3 sky(vec3 direction) {
  vec3 const horizon(0.64f, 0.62f, 0.59f), zenith(0.37f, 0.48f, 0.67f), floor(0.20f, 0.18f, 0.16f);
  float const up = direction.z;
  if (up >= 0) return horizon + (zenith - horizon) * std::sqrt(up);
  return horizon + (floor - horizon) * std::min(1.0f, -4 * up);
}

vec2 unit_disc(vec2 u) {
  float const r = std::sqrt(u.x), phi = 2 * pi * u.y;
  return {r * std::cos(phi), r * std::sin(phi)};
}

float schlick(float f0, float cosine) {
  float const m = std::clamp(1 - cosine, 0.0f, 1.0f);
  return f0 + (1 - f0) * m * m * m * m * m;
}

struct surface_point {
  vec3 position, geometric, normal, albedo;
  synth_material const* material;
};

// What the glossy lobe's facets reflect.
vec3 mirror(surface_point const& p, float cosine) {
  if (!p.material->metal) return vec3(schlick(p.material->f0, cosine));
  return p.albedo + (vec3(1.0f) - p.albedo) * schlick(0, cosine);
}

// A GGX normal as seen from `out` (E. Heitz, "Sampling the GGX Distribution of Visible Normals", JCGT 2018).
vec3 visible_normal(vec3 out, float alpha, vec2 u) {
  vec3 const v = glm::normalize(vec3(alpha * out.x, alpha * out.y, out.z));
  vec2 p = unit_disc(u);
  float const length2 = v.x * v.x + v.y * v.y;
  vec3 const t1 = length2 > 0 ? vec3(-v.y, v.x, 0.0f) / std::sqrt(length2) : vec3(1, 0, 0), t2 = glm::cross(v, t1);
  float const s = 0.5f * (1 + v.z);
  p.y = (1 - s) * std::sqrt(std::max(0.0f, 1 - p.x * p.x)) + s * p.y;
  vec3 const n = t1 * p.x + t2 * p.y + v * std::sqrt(std::max(0.0f, 1 - p.x * p.x - p.y * p.y));
  return glm::normalize(vec3(alpha * n.x, alpha * n.y, std::max(1e-6f, n.z)));
}

// Smith's masking of GGX for one direction.
float masking(vec3 w, float alpha) {
  float const tan2 = (w.x * w.x + w.y * w.y) / std::max(1e-8f, w.z * w.z);
  return 2 / (1 + std::sqrt(1 + alpha * alpha * tan2));
}

u8 to_srgb(float linear) { return static_cast<u8>(255 * gart::displayed(std::clamp(linear, 0.0f, 1.0f)) + 0.5f); }

}  // namespace

struct synth_renderer::implementation {
  synth_scene scene;
  embree_scene tracer;
  unsigned threads;
  lamp light;

  implementation(synth_scene s, int wanted)
      : scene(std::move(s)),
        tracer(scene),
        threads(wanted > 0 ? wanted : std::max(1u, std::thread::hardware_concurrency())) {}

  template <class F>
  void for_each(int n, F const& f) const {
    std::atomic<int> next{0};
    auto const work = [&] {
      for (int i; (i = next++) < n;) f(i);
    };
    std::vector<std::jthread> others;
    for (unsigned k = 1; k < threads; ++k) others.emplace_back(work);
    work();
  }

  surface_point resolve(vec3 direction, synth_hit const& hit) const {
    synth_mesh const& mesh = scene[hit.mesh];
    u32 const* corner = &mesh.index[3 * hit.triangle];
    float const w = 1 - hit.u - hit.v;
    surface_point p;
    p.material = &mesh.material;
    p.position = w * mesh.position[corner[0]] + hit.u * mesh.position[corner[1]] + hit.v * mesh.position[corner[2]];
    p.geometric = glm::normalize(hit.normal);
    p.normal =
        glm::normalize(w * mesh.normal[corner[0]] + hit.u * mesh.normal[corner[1]] + hit.v * mesh.normal[corner[2]]);
    if (glm::dot(p.geometric, direction) > 0) p.geometric = -p.geometric;
    if (glm::dot(p.normal, p.geometric) < 0) p.normal = -p.normal;
    // A smooth normal that turns away from the viewer at a silhouette would shade a visible point as hidden.
    float const facing = -glm::dot(p.normal, direction);
    if (facing < 0.02f) p.normal = glm::normalize(p.normal + (0.02f - facing) * -direction);
    p.albedo = mesh.material.albedo(p.position,
                                    w * mesh.uv[corner[0]] + hit.u * mesh.uv[corner[1]] + hit.v * mesh.uv[corner[2]]);
    return p;
  }

  // Light of one point of the lamp that the surface reflects to `out`. That is a unit vector in the frame of its
  // normal.
  vec3 from_lamp(surface_point const& p, frame const& basis, vec3 out, float fresnel, vec2 u) const {
    vec2 const d = light.radius * unit_disc(u);
    vec3 to_light = light.center + light.axes.x * d.x + light.axes.y * d.y - p.position;
    float const distance2 = glm::dot(to_light, to_light), distance = std::sqrt(distance2);
    to_light /= distance;
    vec3 const in = basis.to_local(to_light);
    float const there = -glm::dot(light.axes.z, to_light);
    if (in.z <= 0 || there <= 0 || glm::dot(p.geometric, to_light) <= 0) return vec3(0.0f);
    synth_material const& m = *p.material;
    vec3 reflectance = m.metal ? vec3(0.0f) : p.albedo * ((1 - fresnel) / pi);
    if (m.metal || m.f0 > 0) {
      vec3 const half = glm::normalize(in + out);
      float const alpha2 = m.roughness * m.roughness, lobe = 1 + half.z * half.z * (alpha2 - 1);
      reflectance += mirror(p, glm::dot(out, half)) * (alpha2 / (pi * lobe * lobe) * masking(in, m.roughness) *
                                                       masking(out, m.roughness) / (4 * in.z * out.z));
    }
    if (tracer.occluded(p.position + offset * p.geometric, to_light, 0, distance)) return vec3(0.0f);
    return light.radiance * reflectance * (in.z * there * pi * light.radius * light.radius / distance2);
  }

  // False where the camera's ray meets nothing. The lamp is reached by sampling the lamp alone, since all lobes are
  // wider. Rays that bounce pass through it.
  bool radiance(vec3 origin, vec3 direction, sample_sequence& random, vec3& result) const {
    vec3 weight(1.0f);
    result = vec3(0.0f);
    int mirrors = 0;
    for (int vertex = 0; vertex < path_vertices; ++vertex) {
      synth_hit hit;
      if (!tracer.intersect(origin, direction, 0, hit)) {
        if (vertex == 0) return false;
        result += weight * sky(direction);
        break;
      }
      surface_point const p = resolve(direction, hit);
      synth_material const& m = *p.material;
      if (m.mirror && mirrors++ < most_mirrors) {
        vec3 const along = glm::reflect(direction, p.normal);
        // At a silhouette the smooth normal may send it into the mirror.
        direction = glm::dot(along, p.geometric) > 0 ? along : glm::reflect(direction, p.geometric);
        origin = p.position + offset * p.geometric;
        --vertex;  // as if seen from behind it
        continue;
      }
      frame const basis(p.normal);
      vec3 const out = basis.to_local(-direction);
      float const fresnel = m.metal ? 1 : m.f0 > 0 ? schlick(m.f0, out.z) : 0;
      vec2 const on_lamp = random.next();
      result += weight * from_lamp(p, basis, out, fresnel, on_lamp);
      if (vertex + 1 == path_vertices) {
        result += weight * p.albedo * glow;
        break;
      }

      vec2 const lobe = random.next();
      float const chance = m.metal ? 1 : m.f0 > 0 ? std::clamp(fresnel, 0.25f, 0.75f) : 0;
      vec3 in;
      if (chance == 1 || (chance > 0 && random.next().x < chance)) {
        vec3 const half = visible_normal(out, m.roughness, lobe);
        in = 2 * glm::dot(out, half) * half - out;
        if (in.z <= 0) break;
        weight *= mirror(p, glm::dot(out, half)) * (masking(in, m.roughness) / chance);
      } else {
        vec2 const d = unit_disc(lobe);
        in = vec3(d.x, d.y, std::sqrt(std::max(0.0f, 1 - d.x * d.x - d.y * d.y)));
        weight *= p.albedo * ((1 - fresnel) / (1 - chance));
      }
      direction = glm::normalize(basis.to_world(in));
      if (glm::dot(direction, p.geometric) <= 0) break;
      origin = p.position + offset * p.geometric;
    }
    result = glm::min(exposure * result, vec3(brightest));
    return true;
  }
};

synth_renderer::synth_renderer(synth_scene scene, int threads)
    : implementation_(std::make_unique<implementation>(std::move(scene), threads)) {}

synth_renderer::~synth_renderer() = default;

gart::image8 synth_renderer::render(gart::camera const& view, int samples, u64 seed) const {
  implementation const& tracer = *implementation_;
  gart::image8 image(view.width, view.height, 4);
  tracer.for_each(view.height, [&](int y) {
    for (int x = 0; x < view.width; ++x) {
      u64 const stream = hash(seed, static_cast<u64>(y) * view.width + x);
      vec3 sum(0.0f);
      int covered = 0, s = 0;
      // A pixel that an eighth of its samples, evenly spread, find empty is empty.
      for (; s < samples && (covered > 0 || s <= std::max(8, samples / 8)); ++s) {
        sample_sequence random(stream, s);
        vec2 const at = random.next();
        vec3 sample;
        gart::ray const r = gart::ray_through(view, x + at.x, y + at.y);
        vec3 const origin(view.position + gart::vec3d(r.origin));
        if (r.direction == vec3(0.0f) || !tracer.radiance(origin, r.direction, random, sample)) continue;
        sum += sample;
        ++covered;
      }
      if (covered == 0) continue;
      for (int c = 0; c < 3; ++c) image.at(x, y, c) = to_srgb(sum[c] / covered);
      image.at(x, y, 3) = static_cast<u8>(255.0f * covered / s + 0.5f);
    }
  });
  return image;
}

gart::image_float synth_renderer::distances(gart::camera const& view) const {
  implementation const& tracer = *implementation_;
  gart::image_float map(view.width, view.height, 1);
  tracer.for_each(view.height, [&](int y) {
    for (int x = 0; x < view.width; ++x) {
      synth_hit hit;
      gart::ray const r = gart::ray_through(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
      vec3 const origin(view.position + gart::vec3d(r.origin));
      if (r.direction != vec3(0.0f) && tracer.tracer.intersect(origin, r.direction, 0, hit)) map.at(x, y, 0) = hit.t;
    }
  });
  return map;
}

gart::point_cloud synth_renderer::points(std::vector<gart::camera> const& cameras, std::size_t count, u64 seed) const {
  implementation const& tracer = *implementation_;
  struct triangle {
    u32 mesh, index;
  };
  std::vector<triangle> triangles;
  std::vector<double> cumulative;  // of area times density
  for (u32 m = 0; m < tracer.scene.size(); ++m) {
    synth_mesh const& mesh = tracer.scene[m];
    for (u32 t = 0; t < mesh.index.size() / 3; ++t) {
      vec3 const a = mesh.position[mesh.index[3 * t]];
      vec3 const n = glm::cross(mesh.position[mesh.index[3 * t + 1]] - a, mesh.position[mesh.index[3 * t + 2]] - a);
      triangles.push_back({m, t});
      cumulative.push_back((cumulative.empty() ? 0 : cumulative.back()) +
                           mesh.point_density * std::sqrt(glm::dot(n, n)));
    }
  }

  gart::point_cloud cloud;
  cloud.position.resize(3 * count);
  cloud.color.resize(3 * count);
  tracer.for_each(static_cast<int>(count), [&](int i) {
    int const attempts = 1000, samples = 32;  // about half of all attempts succeed; the last is kept, seen or not
    for (int attempt = 0; attempt < attempts; ++attempt) {
      u64 const stream = hash(hash(seed, i), attempt);
      auto const random = [&](u64 k) { return unit_float(static_cast<u32>(hash(stream, k))); };
      auto const picked = std::upper_bound(cumulative.begin(), cumulative.end() - 1, random(0) * cumulative.back());
      triangle const chosen = triangles[picked - cumulative.begin()];
      synth_mesh const& mesh = tracer.scene[chosen.mesh];
      u32 const* corner = &mesh.index[3 * chosen.index];
      float const root = std::sqrt(random(1)), u = root * (1 - random(2)), v = root * random(2);
      vec3 const p =
          (1 - root) * mesh.position[corner[0]] + u * mesh.position[corner[1]] + v * mesh.position[corner[2]];
      gart::camera const& view = cameras[static_cast<std::size_t>(random(3) * static_cast<float>(cameras.size()))];
      vec3 const origin(view.position);
      float const distance = glm::length(p - origin);
      vec3 const direction = (p - origin) / distance;
      if (tracer.tracer.occluded(origin, direction, 0, distance - 1e-3f) && attempt + 1 < attempts) continue;
      vec3 color(0.0f);
      int seen = 0;
      for (int s = 0; s < samples; ++s) {
        sample_sequence sequence(stream, s);
        vec3 sample;
        if (tracer.radiance(origin, direction, sequence, sample)) color += sample, ++seen;
      }
      for (int c = 0; c < 3; ++c) {
        cloud.position[3 * i + c] = p[c];
        cloud.color[3 * i + c] = to_srgb(color[c] / static_cast<float>(std::max(1, seen)));
      }
      break;
    }
  });
  return cloud;
}

}  // namespace gart_cli
