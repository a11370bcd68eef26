#include "synth_scene.hpp"

#include "synth_random.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

namespace gart_cli {
namespace {

constexpr float pi = std::numbers::pi_v<float>;
constexpr float ground = -0.42f;  // the height of the disc's top

vec3 mix(vec3 a, vec3 b, float t) { return a + (b - a) * t; }

float smooth(float edge0, float edge1, float x) {
  float const t = std::clamp((x - edge0) / (edge1 - edge0), 0.0f, 1.0f);
  return t * t * (3 - 2 * t);
}

// 1 in a band around multiples of the period, 0 between, with soft edges: sharper than a pixel would only alias.
float stripes(float x, float width, float softness) {
  float const distance = std::abs(x - std::round(x));
  return 1 - smooth(width / 2 - softness, width / 2 + softness, distance);
}

// Value noise in [0, 1], C1, with features of unit size.
float noise(vec3 p) {
  auto const corner = [](int x, int y, int z) {
    return unit_float(static_cast<u32>(
        hash((static_cast<u64>(static_cast<u32>(x)) << 32 | static_cast<u32>(y)) ^ (static_cast<u64>(z) << 16))));
  };
  int const x = static_cast<int>(std::floor(p.x)), y = static_cast<int>(std::floor(p.y)),
            z = static_cast<int>(std::floor(p.z));
  float const fx = smooth(0, 1, p.x - x), fy = smooth(0, 1, p.y - y), fz = smooth(0, 1, p.z - z);
  float layer[2];
  for (int k = 0; k < 2; ++k) {
    float const a = std::lerp(corner(x, y, z + k), corner(x + 1, y, z + k), fx);
    float const b = std::lerp(corner(x, y + 1, z + k), corner(x + 1, y + 1, z + k), fx);
    layer[k] = std::lerp(a, b, fy);
  }
  return std::lerp(layer[0], layer[1], fz);
}

float turbulence(vec3 p) { return (noise(p) + 0.5f * noise(p * 2.1f + 7.3f)) / 1.5f; }

vec3 disc_albedo(vec3 p, vec2) {
  vec3 const walnut = mix(vec3(0.16f, 0.08f, 0.045f), vec3(0.30f, 0.16f, 0.085f), noise(p * vec3(9, 9, 60)));
  float const radius = std::hypot(p.x, p.y);
  if (radius > 0.985f) return walnut;
  if (radius > 0.955f) return {0.72f, 0.53f, 0.27f};
  float const u = (0.87f * p.x + 0.5f * p.y) / 0.27f, v = (-0.5f * p.x + 0.87f * p.y) / 0.27f;
  bool const dark = (static_cast<int>(std::floor(u)) + static_cast<int>(std::floor(v))) & 1;
  float const mottle = 0.82f + 0.36f * turbulence(p * 11.0f);
  vec3 const tile = dark ? vec3(0.10f, 0.20f, 0.23f) : vec3(0.70f, 0.64f, 0.53f);
  return tile * mottle;
}

vec3 vase_albedo(vec3, vec2 uv) {
  vec3 const glaze(0.025f, 0.075f, 0.27f), slip(0.74f, 0.70f, 0.60f);
  float const zigzag = uv.y + 0.035f * (2 * std::abs(uv.x * 12 - std::round(uv.x * 12)) - 0.5f);
  float const bands = std::max(
      {1 - smooth(0.010f, 0.016f, std::abs(zigzag - 0.235f)), 1 - smooth(0.010f, 0.016f, std::abs(zigzag - 0.295f)),
       1 - smooth(0.006f, 0.010f, std::abs(uv.y - 0.17f)), 1 - smooth(0.006f, 0.010f, std::abs(uv.y - 0.36f))});
  return mix(glaze, slip, bands);
}

vec3 knot_albedo(vec3, vec2 uv) {
  return mix(vec3(0.66f, 0.10f, 0.055f), vec3(0.80f, 0.71f, 0.55f), stripes(uv.x * 24 + uv.y, 0.4f, 0.04f));
}

vec3 box_albedo(vec3 p, vec2) {
  float const band = 0.5f + 0.5f * std::sin(26 * turbulence(p * 2.6f + 5.0f));
  return mix(vec3(0.62f, 0.25f, 0.045f), vec3(0.88f, 0.68f, 0.33f), smooth(0.15f, 0.85f, band));
}

vec3 leaf_albedo(vec3 p, vec2 uv) {
  vec3 const green = mix(vec3(0.05f, 0.17f, 0.04f), vec3(0.34f, 0.52f, 0.10f), smooth(0.1f, 1.0f, uv.y));
  float const rib = 1 - smooth(0.05f, 0.18f, std::abs(uv.x - 0.5f));
  return mix(green, vec3(0.55f, 0.66f, 0.28f), 0.6f * rib) * (0.85f + 0.3f * noise(p * 14.0f));
}

vec3 copper(vec3 p, vec2) { return mix(vec3(0.80f, 0.34f, 0.20f), vec3(0.88f, 0.44f, 0.28f), noise(p * 12.0f)); }
vec3 brass(vec3, vec2) { return {0.83f, 0.60f, 0.24f}; }
vec3 steel(vec3, vec2) { return {0.62f, 0.63f, 0.66f}; }

using surface = std::function<vec3(float u, float v)>;

// Adds the surface over [0, 1]^2 as a grid of nu x nv cells. Normals come from differences of the formula. These are
// taken a little inside the border: so a pole, where one side vanishes, has one too.
void add_surface(synth_mesh& mesh, int nu, int nv, surface const& f) {
  u32 const first = static_cast<u32>(mesh.position.size());
  for (int j = 0; j <= nv; ++j)
    for (int i = 0; i <= nu; ++i) {
      float const u = static_cast<float>(i) / nu, v = static_cast<float>(j) / nv, step = 1e-3f;
      float const ui = std::clamp(u, 2 * step, 1 - 2 * step), vi = std::clamp(v, 2 * step, 1 - 2 * step);
      vec3 const n = glm::cross(f(ui + step, vi) - f(ui - step, vi), f(ui, vi + step) - f(ui, vi - step));
      mesh.position.push_back(f(u, v));
      mesh.normal.push_back(glm::normalize(n));
      mesh.uv.emplace_back(u, v);
    }
  for (u32 j = 0; j < static_cast<u32>(nv); ++j)
    for (u32 i = 0; i < static_cast<u32>(nu); ++i) {
      u32 const a = first + j * (nu + 1) + i, b = a + 1, c = a + nu + 1, d = c + 1;
      mesh.index.insert(mesh.index.end(), {a, b, d, a, d, c});
    }
}

// A tube of the given radius along a curve over [0, 1] that is curved everywhere: its frame is Frenet's.
surface tube(std::function<vec3(float)> curve, float radius) {
  return [=](float u, float v) {
    float const step = 4e-3f;
    vec3 const before = curve(u - step), here = curve(u), after = curve(u + step);
    vec3 const tangent = glm::normalize(after - before);
    vec3 const a = glm::normalize(glm::cross(after + before - 2.0f * here, tangent)), b = glm::cross(tangent, a);
    return curve(u) + radius * (std::cos(2 * pi * v) * a + std::sin(2 * pi * v) * b);
  };
}

// A profile of (radius, height) points, joined by a Catmull-Rom spline or straight, turned about a vertical axis.
surface revolution(std::vector<vec2> profile, vec3 base, bool straight = false) {
  return [=](float u, float v) {
    float const s = v * static_cast<float>(profile.size() - 1);
    int const n = static_cast<int>(profile.size()), k = std::clamp(static_cast<int>(s), 0, n - 2);
    float const t = s - static_cast<float>(k);
    vec2 const p0 = profile[std::max(k - 1, 0)], p1 = profile[k], p2 = profile[k + 1],
               p3 = profile[std::min(k + 2, n - 1)];
    vec2 p = p1 + t * (p2 - p1);
    if (!straight)
      p = p1 + 0.5f * t * (p2 - p0 + t * (2.0f * p0 - 5.0f * p1 + 4.0f * p2 - p3 + t * (3.0f * (p1 - p2) + p3 - p0)));
    return base + vec3(p.x * std::cos(2 * pi * u), p.x * std::sin(2 * pi * u), p.y);
  };
}

surface ball(vec3 center, float radius) {
  return [=](float u, float v) {
    float const theta = pi * v;
    return center + radius * vec3(std::sin(theta) * std::cos(2 * pi * u), std::sin(theta) * std::sin(2 * pi * u),
                                  -std::cos(theta));
  };
}

surface ring(vec3 center, float radius, float thickness, vec3 axis) {
  vec3 const n = glm::normalize(axis), a = glm::normalize(glm::cross(n, vec3(0.31f, 0.74f, 0.59f))),
             b = glm::cross(n, a);
  return tube([=](float u) { return center + radius * (std::cos(2 * pi * u) * a + std::sin(2 * pi * u) * b); },
              thickness);
}

synth_mesh make_disc() {
  synth_mesh mesh{.material = {disc_albedo}, .point_density = 0.6f};
  std::vector<vec2> const profile = {{0, -0.07f}, {1.06f, -0.07f}, {1.08f, -0.05f}, {1.08f, -0.018f},
                                     {1.062f, 0}, {0.98f, 0},      {0, 0}};
  add_surface(mesh, 128, 6, revolution(profile, {0, 0, ground}, true));
  // Straight facets: each ring of vertices would round the edge beside it, so the flat parts take the vertical normal.
  for (std::size_t i = 0; i < mesh.position.size(); ++i)
    if (std::hypot(mesh.position[i].x, mesh.position[i].y) < 1.0f) mesh.normal[i] = vec3(0, 0, 1);
  return mesh;
}

synth_mesh make_vase(vec3 base) {
  synth_mesh mesh{.material = {vase_albedo, 0.06f, 0.18f}};
  std::vector<vec2> const profile = {{0.10f, 0.0f},   {0.155f, 0.015f}, {0.21f, 0.09f},   {0.265f, 0.20f},
                                     {0.27f, 0.31f},  {0.215f, 0.42f},  {0.135f, 0.50f},  {0.105f, 0.57f},
                                     {0.13f, 0.63f},  {0.155f, 0.65f},  {0.145f, 0.655f}, {0.115f, 0.625f},
                                     {0.095f, 0.57f}, {0.12f, 0.50f},   {0.20f, 0.42f}};
  add_surface(mesh, 96, 84, revolution(profile, base));
  return mesh;
}

synth_mesh make_leaves(vec3 base, u64 seed) {
  synth_mesh mesh{.material = {leaf_albedo, 0.04f, 0.45f}, .point_density = 3};
  for (u64 leaf = 0; leaf < 22; ++leaf) {
    auto const random = [&](u64 k) { return unit_float(static_cast<u32>(hash(hash(seed, leaf), k))); };
    float const azimuth = 2.39996f * static_cast<float>(leaf) + 0.5f * random(0);
    float const length = 0.50f + 0.30f * random(1), lean = 0.25f + 0.75f * static_cast<float>(leaf) / 22;
    float const curl = 0.5f + 0.8f * random(2), width = 0.030f + 0.014f * random(3);
    vec3 const out(std::cos(azimuth), std::sin(azimuth), 0), side(-out.y, out.x, 0);
    auto const spine = [=](float s) {
      float const angle = lean * 0.8f + curl * s * s;  // from the vertical, growing as the leaf bends over
      return base + out * (0.02f + length * s * std::sin(angle) * 0.9f) +
             vec3(0, 0, length * s * std::cos(angle * 0.9f));
    };
    add_surface(mesh, 4, 20, [=](float u, float v) {
      float const across = 2 * u - 1, half = width * std::pow(std::max(0.0f, std::sin(pi * (0.12f + 0.88f * v))), 0.8f);
      vec3 const fold(0, 0, 0.35f * half * std::abs(across));
      return spine(v) + side * (half * across) + fold;
    });
  }
  return mesh;
}

synth_mesh make_knot(vec3 center) {
  synth_mesh mesh{.material = {knot_albedo, 0.045f, 0.28f}};
  auto const curve = [=](float u) {
    float const a = 2 * pi * u, r = 0.205f + 0.085f * std::cos(3 * a);
    vec3 const k(r * std::cos(2 * a), r * std::sin(2 * a), 0.105f * std::sin(3 * a));
    return center + vec3(0.96f * k.x - 0.28f * k.z, 0.28f * k.x + 0.96f * k.z, k.y);  // stood upright, turned a little
  };
  add_surface(mesh, 256, 22, tube(curve, 0.058f));
  return mesh;
}

synth_mesh make_box(vec3 center, float half, float radius, float turn) {
  synth_mesh mesh{.material = {box_albedo, 0.04f, 0.35f}};
  for (int axis = 0; axis < 3; ++axis)
    for (float side : {-1.0f, 1.0f})
      add_surface(mesh, 20, 20, [=](float u, float v) {
        vec3 p(0.0f);
        p[axis] = side * half;
        p[(axis + 1) % 3] = side * half * (2 * u - 1);
        p[(axis + 2) % 3] = half * (2 * v - 1);
        float const flat = half - radius;
        vec3 const inner(std::clamp(p.x, -flat, flat), std::clamp(p.y, -flat, flat), std::clamp(p.z, -flat, flat));
        p = inner + radius * glm::normalize(p - inner);
        return center +
               vec3(std::cos(turn) * p.x - std::sin(turn) * p.y, std::sin(turn) * p.x + std::cos(turn) * p.y, p.z);
      });
  return mesh;
}

synth_mesh make_coil(vec3 base) {
  synth_mesh mesh{.material = {steel, 0, 0.30f, true}, .point_density = 3};
  auto const curve = [=](float u) {
    float const a = 2 * pi * 5.5f * u, r = 0.13f - 0.05f * u;
    return base + vec3(r * std::cos(a), r * std::sin(a), 0.012f + 0.30f * u);
  };
  add_surface(mesh, 320, 8, tube(curve, 0.011f));
  return mesh;
}

// Flat: upright, towards the middle, as high as the vase. A ball has the grid of a scene.json's sphere.
synth_mesh make_mirror(synth_mirror kind) {
  synth_mesh mesh{.material = {[](vec3, vec2) { return vec3(1.0f); }}, .point_density = 0};
  mesh.material.mirror = true;
  if (kind == synth_mirror::ball)
    add_surface(mesh, 128, 64, ball(ball_center, ball_radius));
  else
    add_surface(mesh, 1, 1, [](float u, float v) { return vec3(-0.92f, 1.2f * (u - 0.5f), ground + 0.95f * v); });
  return mesh;
}

// A copper ball in thin brass rings.
void add_globe(synth_scene& scene) {
  vec3 const globe(0.46f, 0.46f, ground + 0.44f);
  synth_mesh core{.material = {copper, 0, 0.28f, true}};
  add_surface(core, 72, 36, ball(globe, 0.20f));
  scene.push_back(std::move(core));
  synth_mesh rings{.material = {brass, 0, 0.30f, true}, .point_density = 3};
  add_surface(rings, 144, 10, ring(globe, 0.27f, 0.010f, {0.9f, 0.1f, 0.45f}));
  add_surface(rings, 144, 10, ring(globe, 0.30f, 0.010f, {-0.35f, 0.8f, 0.5f}));
  add_surface(rings, 144, 10, ring(globe, 0.33f, 0.012f, {0.25f, -0.25f, 0.95f}));
  add_surface(rings, 144, 10, ring(globe, 0.36f, 0.013f, {0.75f, -0.65f, 0.0f}));
  add_surface(rings, 48, 12,
              revolution({{0.0f, 0.0f}, {0.15f, 0.0f}, {0.15f, 0.025f}, {0.05f, 0.04f}, {0.03f, 0.085f}, {0.0f, 0.09f}},
                         {globe.x, globe.y, ground}, true));
  scene.push_back(std::move(rings));
}

}  // namespace

synth_scene make_synth_scene(u64 seed, synth_mirror mirror) {
  synth_scene scene;
  scene.push_back(make_disc());
  vec3 const vase(-0.30f, 0.34f, ground);
  scene.push_back(make_vase(vase));
  scene.push_back(make_leaves(vase + vec3(0, 0, 0.56f), seed));
  scene.push_back(make_knot({-0.30f, -0.52f, ground + 0.34f}));
  vec3 const box(0.50f, -0.36f, ground + 0.215f);
  scene.push_back(make_box(box, 0.215f, 0.055f, 0.45f));
  scene.push_back(make_coil(box + vec3(0, 0, 0.215f)));
  if (mirror != synth_mirror::ball) add_globe(scene);
  if (mirror != synth_mirror::none) scene.push_back(make_mirror(mirror));
  return scene;
}

}  // namespace gart_cli
