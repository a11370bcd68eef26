#include "scenes.hpp"

#include <algorithm>
#include <cmath>
#include <random>

namespace oracle {

namespace {

using gart::vec3;
using gart::vec3d;

// The standard fixes the engine's numbers but not the distributions'.
class random {
 public:
  explicit random(std::uint64_t seed) : engine_(seed) {}
  float uniform(float low, float high) { return low + (high - low) * float(double(engine_() >> 11) * 0x1p-53); }
  float normal() {
    double const u = (double(engine_() >> 11) + 1) * 0x1p-53, v = double(engine_() >> 11) * 0x1p-53;
    return float(std::sqrt(-2 * std::log(u)) * std::cos(6.283185307179586 * v));
  }
  std::uint64_t seed() { return engine_(); }

 private:
  std::mt19937_64 engine_;
};

struct builder {
  random& rng;
  gart::gaussian_model model;

  builder(random& r, int sh_degree) : rng(r) { model.sh_degree = sh_degree; }

  // A random rotation with a norm far from 1, and random colours, some of them clamped. Of degree 0 none lies within
  // rounding of the clamp: it would do so for every ray, and all that see it would be undecided.
  void add(vec3 mean, vec3 scale, float logit) {
    float q[4], squares = 0;
    do {
      squares = 0;
      for (float& x : q) x = rng.normal(), squares += x * x;
    } while (squares < 0.01f);
    float const norm = std::exp(rng.uniform(-1.0f, 1.0f));
    for (float x : q) model.quaternion.push_back(x * norm / std::sqrt(squares));
    for (int a = 0; a < 3; ++a) model.mean.push_back(mean[a]), model.log_scale.push_back(std::log(scale[a]));
    model.opacity.push_back(logit);
    add_color();
  }
  void add_color() {
    int const coefficients = gart::sh_coefficients(model.sh_degree);
    for (int k = 0; k < coefficients; ++k)
      for (int c = 0; c < 3; ++c) {
        float x = rng.normal() * (k == 0 ? 1.2f : 0.25f);
        while (coefficients == 1 && std::abs(0.5f + 0.2820948f * x) < 1e-4f) x = rng.normal() * 1.2f;
        model.sh.push_back(x);
      }
  }
  // The last Gaussian's geometry once more, with its own opacity and colours.
  void repeat(float logit) {
    for (int a = 0; a < 3; ++a) {
      model.mean.push_back(model.mean[model.mean.size() - 3]);
      model.log_scale.push_back(model.log_scale[model.log_scale.size() - 3]);
    }
    for (int a = 0; a < 4; ++a) model.quaternion.push_back(model.quaternion[model.quaternion.size() - 4]);
    model.opacity.push_back(logit);
    add_color();
  }
  vec3 inside(float radius) {
    vec3 p;
    do p = vec3(rng.uniform(-1, 1), rng.uniform(-1, 1), rng.uniform(-1, 1));
    while (p.x * p.x + p.y * p.y + p.z * p.z > 1);
    return p * radius;
  }
  vec3 axes(float low, float high) {
    return {std::exp(rng.uniform(std::log(low), std::log(high))), std::exp(rng.uniform(std::log(low), std::log(high))),
            std::exp(rng.uniform(std::log(low), std::log(high)))};
  }
};

vec3d cross_of(vec3d a, vec3d b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
vec3d unit(vec3d a) { return a / std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }

// A camera `distance` from `target` in a random direction, with a random roll and an off-centre principal point.
gart::camera look_at(random& rng, vec3d target, float distance, int width, int height, float focal_in_widths) {
  vec3d const forward = unit(vec3d(rng.normal(), rng.normal(), rng.normal()) + vec3d(1e-3, 0, 0));
  vec3d const any = unit(vec3d(rng.normal(), rng.normal(), rng.normal()));
  vec3d const right = unit(cross_of(any, forward)), down = cross_of(forward, right);
  gart::camera c;
  c.width = width, c.height = height;
  c.fx = focal_in_widths * float(width), c.fy = c.fx * rng.uniform(0.9f, 1.1f);
  c.cx = 0.5f * float(width) + rng.uniform(-1.5f, 1.5f), c.cy = 0.5f * float(height) + rng.uniform(-1.5f, 1.5f);
  c.rotation[0] = vec3(right), c.rotation[1] = vec3(down), c.rotation[2] = vec3(forward);
  c.position = target - double(distance) * forward;
  return c;
}

gart::render_options options_of(random& rng) {
  gart::render_options o;
  o.background = vec3(rng.uniform(0, 1), rng.uniform(0, 1), rng.uniform(0, 1));
  return o;
}

scene cloud(random& rng, std::string name, int degree, int active_degree, vec3d centre) {
  builder b(rng, degree);
  for (int i = 0; i < 80; ++i) b.add(vec3(centre) + b.inside(1.0f), b.axes(0.05f, 0.6f), rng.uniform(-3.0f, 3.0f));
  return {name, b.model, look_at(rng, centre, 3.0f, 37, 23, 0.9f), options_of(rng), active_degree};
}

}  // namespace

std::vector<scene> scenes(std::uint64_t seed) {
  std::vector<scene> all;
  random rng(seed);

  all.push_back(cloud(rng, "cloud", 3, 3, {0, 0, 0}));
  all.push_back(cloud(rng, "cloud, SH of degree 0", 0, 0, {0, 0, 0}));
  all.push_back(cloud(rng, "cloud, SH of degree 1", 1, 1, {0, 0, 0}));
  all.push_back(cloud(rng, "cloud, SH of degree 2", 2, 2, {0, 0, 0}));
  all.push_back(cloud(rng, "cloud, degree 1 of 3 active", 3, 1, {0, 0, 0}));
  all.push_back(cloud(rng, "cloud far from the origin", 2, 2, {1000.0, -400.0, 250.0}));

  // The hit that ends a ray carries much of its colour.
  all.push_back(cloud(rng, "cloud, rays ended at half", 3, 3, {0, 0, 0}));
  all.back().options.transmittance_min = 0.5f;

  // The cap ends rays in front of what most of them would still meet.
  all.push_back(cloud(rng, "cloud, rays ended after three hits", 3, 3, {0, 0, 0}));
  all.back().options.max_hits = 3;

  {
    scene s = cloud(rng, "cloud through an OPENCV lens", 3, 3, {0, 0, 0});
    s.view.lens = {-0.12f, 0.03f, 0.004f, -0.003f};
    s.view.width = 29, s.view.height = 41;
    all.push_back(s);
    s = cloud(rng, "cloud through a SIMPLE_RADIAL lens", 1, 1, {0, 0, 0});
    s.view.lens.k1 = 0.15f;
    all.push_back(s);
  }
  {
    // One axis a thousand times the others, then one a thousandth of the others.
    builder needles(rng, 3), pancakes(rng, 2);
    for (int i = 0; i < 60; ++i) {
      float const thin = std::exp(rng.uniform(std::log(0.02f), std::log(0.06f)));
      float const wide = thin * std::exp(rng.uniform(std::log(30.0f), std::log(1000.0f)));
      needles.add(needles.inside(1.0f), {wide, thin, thin * rng.uniform(1.0f, 2.0f)}, rng.uniform(-1.0f, 4.0f));
      pancakes.add(pancakes.inside(1.0f), {wide, wide * rng.uniform(0.5f, 1.0f), thin}, rng.uniform(-3.0f, 1.0f));
    }
    all.push_back({"needles", needles.model, look_at(rng, {0, 0, 0}, 3.0f, 37, 23, 0.9f), options_of(rng), 3});
    all.push_back({"pancakes", pancakes.model, look_at(rng, {0, 0, 0}, 3.0f, 37, 23, 0.9f), options_of(rng), 2});
  }
  {
    // At each centre the same ellipsoid four times (ties, by id), and others that only share the centre.
    builder b(rng, 1);
    for (int i = 0; i < 12; ++i) {
      vec3 const centre = b.inside(1.0f);
      b.add(centre, b.axes(0.1f, 0.8f), rng.uniform(-2.0f, 2.0f));
      for (int copy = 0; copy < 3; ++copy) b.repeat(rng.uniform(-2.0f, 2.0f));
      for (int other = 0; other < 3; ++other) b.add(centre, b.axes(0.1f, 0.8f), rng.uniform(-2.0f, 2.0f));
    }
    all.push_back({"coincident centres", b.model, look_at(rng, {0, 0, 0}, 3.0f, 37, 23, 0.9f), options_of(rng), 1});
  }
  {
    builder b(rng, 2);
    for (int i = 0; i < 50; ++i) b.add(b.inside(5.0f), b.axes(1.0f, 20.0f), rng.uniform(-4.0f, 0.0f));
    all.push_back(
        {"huge, around the camera", b.model, look_at(rng, {0, 0, 0}, 0.1f, 37, 23, 0.4f), options_of(rng), 2});
  }
  {
    // Rays end after two hits at the clamp; the threshold keeps clear of 0.01^2.
    builder b(rng, 1);
    for (int i = 0; i < 120; ++i) b.add(b.inside(1.0f), b.axes(0.15f, 0.4f), rng.uniform(4.0f, 12.0f));
    scene s{"near-opaque stack", b.model, look_at(rng, {0, 0, 0}, 3.0f, 23, 19, 0.9f), options_of(rng), 1};
    s.options.transmittance_min = 3e-4f;
    all.push_back(s);
  }
  {
    // Faint, so that the few orders which rounding decides do not show.
    builder b(rng, 1);
    for (int i = 0; i < 2400; ++i) b.add(b.inside(1.0f), b.axes(0.3f, 1.0f), rng.uniform(-8.0f, -6.2f));
    scene s{"thousands on a ray", b.model, look_at(rng, {0, 0, 0}, 4.0f, 3, 3, 6.0f), options_of(rng), 1};
    s.options.alpha_min = 1e-4f;
    s.options.transmittance_min = 0;
    all.push_back(s);
    s.name = "thousands on a ray, ended early";
    s.options.transmittance_min = 0.3f;
    all.push_back(s);
  }
  {
    // From a tenth of a pixel to several, some needles and pancakes; beside the image and behind the camera too.
    auto const through_pixels = [&](std::string name, int degree, float antialias) {
      builder b(rng, degree);
      for (int i = 0; i < 160; ++i) {
        vec3 axes = b.axes(0.01f, 0.3f);
        if (i % 4 == 0) axes[i / 4 % 3] *= 0.03f;
        b.add(b.inside(i % 8 == 7 ? 4.0f : 1.0f), axes, rng.uniform(-1.0f, 5.0f));
      }
      scene s{name, b.model, look_at(rng, {0, 0, 0}, 3.0f, 37, 23, 0.9f), options_of(rng), degree};
      s.options.antialias = antialias;
      return s;
    };
    all.push_back(through_pixels("antialiased", 3, 0.3f));
    all.push_back(through_pixels("antialiased, a filter of two pixels", 1, 2.0f));
    all.push_back(through_pixels("antialiased through an OPENCV lens", 3, 0.5f));
    all.back().view.lens = {-0.12f, 0.03f, 0.004f, -0.003f};
  }
  // Bands that are not active end within a word of 16 bytes of the row.
  all.push_back(cloud(rng, "cloud, degree 0 of 1 active", 1, 0, {0, 0, 0}));
  all.push_back(cloud(rng, "cloud, degree 0 of 3 active", 3, 0, {0, 0, 0}));
  all.push_back(cloud(rng, "cloud, degree 2 of 3 active", 3, 2, {0, 0, 0}));
  {
    builder b(rng, 0);
    all.push_back({"nothing", b.model, look_at(rng, {0, 0, 0}, 2.0f, 5, 3, 1.0f), options_of(rng), 0});
    b.add({0, 0, 0}, {0.5f, 0.3f, 0.2f}, 1.0f);
    all.push_back({"one Gaussian", b.model, look_at(rng, {0, 0, 0}, 2.0f, 5, 3, 1.0f), options_of(rng), 0});
  }
  return all;
}

scene kernel_scene(std::uint64_t seed, int kernel_degree) {
  random rng(seed + static_cast<std::uint64_t>(kernel_degree));
  builder b(rng, 0);
  for (int i = 0; i < 80; ++i) b.add(b.inside(1.0f), b.axes(0.05f, 0.6f), rng.uniform(-3.0f, 3.0f));
  for (int i = 0; i < 8; ++i) b.add(b.inside(3.0f), b.axes(0.5f, 4.0f), rng.uniform(-4.0f, -1.0f));
  return {"kernels", b.model, look_at(rng, {0, 0, 0}, 3.0f, 37, 23, 0.9f), options_of(rng), 0};
}

scene smooth_scene(std::uint64_t seed, int sh_degree, float aspect) {
  random rng(seed);
  builder b(rng, sh_degree);
  for (int i = 0; i < 8; ++i) {
    float const thin = std::min(0.3f, 3.0f / aspect);
    b.add(b.inside(1.0f), {thin * aspect, thin * std::sqrt(aspect), thin}, rng.uniform(-2.0f, 2.0f));
  }
  // One that is held at the alpha clamp over most of the image.
  b.add({0, 0, 0}, {3.0f, 2.0f, 2.5f}, 9.0f);
  scene s{"smooth", b.model, look_at(rng, {0, 0, 0}, 3.0f, 7, 5, 0.9f), options_of(rng), sh_degree};
  s.options.alpha_min = 1e-12f;
  s.options.transmittance_min = 0;
  s.options.near = -1e30f;
  s.view.lens = {-0.1f, 0.02f, 0.003f, -0.002f};
  return s;
}

}  // namespace oracle
