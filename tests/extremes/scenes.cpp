#include "scenes.hpp"

#include <algorithm>
#include <cfloat>
#include <cmath>

namespace gart_test {

using gart::vec3;
using gart::vec3d;

double number_source::log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }

double number_source::normal() {
  double const radius = std::sqrt(-2 * std::log(1 - uniform(0, 1)));
  return radius * std::cos(6.283185307179586 * uniform(0, 1));
}

void rotate(shape& s, number_source& random, double norm) {
  double squares = 0;
  for (double& q : s.quaternion) q = random.normal(), squares += q * q;
  for (double& q : s.quaternion) q *= norm / std::sqrt(squares);
}

void turn_z_to(shape& s, vec3d const& axis, number_source& random) {
  double const turn = random.uniform(-3, 3);
  // (1 + z.axis, z x axis), times a rotation about z.
  double const w = 1 + axis.z, x = -axis.y, y = axis.x, c = std::cos(turn), d = std::sin(turn);
  double const q[4] = {w * c, x * c + y * d, y * c - x * d, w * d};
  std::copy_n(q, 4, s.quaternion);
}

void append(gart::gaussian_model& m, number_source& random, shape const& s) {
  for (int a = 0; a < 3; ++a) {
    m.mean.push_back(static_cast<float>(s.mean[a]));
    m.log_scale.push_back(static_cast<float>(s.log_scale[a]));
  }
  for (double const q : s.quaternion) m.quaternion.push_back(static_cast<float>(q));
  m.opacity.push_back(s.logit);
  for (int k = 0; k < gart::sh_coefficients(m.sh_degree); ++k)
    for (int c = 0; c < 3; ++c) m.sh.push_back(static_cast<float>(random.normal() * (k == 0 ? 1.2 : 0.25)));
}

gart::camera looking_along_z(int width, int height, float focal) {
  gart::camera c;
  c.width = width, c.height = height;
  c.fx = focal, c.fy = 1.03f * focal;
  c.cx = 0.5f * static_cast<float>(width) + 0.31f, c.cy = 0.5f * static_cast<float>(height) - 0.17f;
  return c;
}

namespace {

gart::camera ordinary_camera() { return looking_along_z(17, 13, 16); }

vec3d in_ball(number_source& random, double radius) {
  for (;;) {
    vec3d const p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1));
    if (p.x * p.x + p.y * p.y + p.z * p.z <= 1) return p * radius;
  }
}

vec3d unit(vec3d const& a) { return a / std::sqrt(a.x * a.x + a.y * a.y + a.z * a.z); }
vec3d cross_of(vec3d const& a, vec3d const& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

vec3d log_axes(number_source& random, double low, double high) {
  return {std::log(random.log_uniform(low, high)), std::log(random.log_uniform(low, high)),
          std::log(random.log_uniform(low, high))};
}

// The direction of a random pixel of the ordinary camera.
vec3d through_image(number_source& random) {
  gart::camera const c = ordinary_camera();
  return unit({(random.uniform(0, c.width) - double{c.cx}) / double{c.fx},
               (random.uniform(0, c.height) - double{c.cy}) / double{c.fy}, 1});
}

// |p| of a ray along the unit vector d that passes the Gaussian's centre at `off`.
double offset_of(shape const& s, vec3d const& off, vec3d const& d) {
  double const w = s.quaternion[0], x = s.quaternion[1], y = s.quaternion[2], z = s.quaternion[3];
  vec3d const axes[3] = {{1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)},
                         {2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)},
                         {2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)}};
  double oo = 0, od = 0, dd = 0;
  for (int k = 0; k < 3; ++k) {
    double const inverse = std::exp(-s.log_scale[k]);
    double const o = inverse * (axes[k].x * off.x + axes[k].y * off.y + axes[k].z * off.z);
    double const e = inverse * (axes[k].x * d.x + axes[k].y * d.y + axes[k].z * d.z);
    oo += o * o, od += o * e, dd += e * e;
  }
  return std::sqrt(oo - od * od / dd);
}

oracle::scene scene_of(std::string name, gart::gaussian_model model, gart::camera const& view) {
  oracle::scene s{std::move(name), std::move(model), view, {}, 1};
  s.options.background = vec3(0.3f, 0.6f, 0.1f);
  return s;
}

// Colours well away from the clamp at zero: among tens of thousands some would lie within rounding of it.
void brighten(gart::gaussian_model& m) {
  for (std::size_t i = 0; i < m.sh.size(); ++i) m.sh[i] = i % 12 < 3 ? 1 + std::abs(m.sh[i]) : 0.25f * m.sh[i];
}

gart::gaussian_model none() {
  gart::gaussian_model m;
  m.sh_degree = 1;
  return m;
}

}  // namespace

gart::gaussian_model cloud(number_source& random, int count, int sh_degree) {
  gart::gaussian_model m;
  m.sh_degree = sh_degree;
  for (int i = 0; i < count; ++i) {
    shape s{in_ball(random, 1) + vec3d(0, 0, 3),
            log_axes(random, 0.05, 0.6),
            {},
            static_cast<float>(random.uniform(-3, 3))};
    rotate(s, random, random.log_uniform(0.3, 3));
    append(m, random, s);
  }
  return m;
}

std::vector<extreme> extremes(std::uint64_t seed) {
  number_source random(seed);
  std::vector<extreme> all;

  // Everything scaled alike, so nothing but the exponents changes: log-scales from -23 to +39.5, places to 1e18.
  for (double const log_unit : {-20.0, -8.0, 20.0, 40.0}) {
    oracle::scene s = scene_of("a world of e^" + std::to_string(static_cast<int>(log_unit)) + " units",
                               cloud(random, 60), ordinary_camera());
    double const unit = std::exp(log_unit);
    for (float& x : s.model.mean) x = static_cast<float>(x * unit);
    for (float& x : s.model.log_scale) x = static_cast<float>(x + log_unit);
    s.options.near = static_cast<float>(0.01 * unit);
    all.push_back({s});
  }
  {
    // Each axis on its own: aspect ratios to e^60, far past what a float ray can resolve. No reference can say more
    // than that the results are finite, and the same for all.
    gart::gaussian_model m = cloud(random, 20);
    for (int i = 0; i < 60; ++i) {
      shape s{in_ball(random, 2) + vec3d(0, 0, 3),
              {random.uniform(-20, 40), random.uniform(-20, 40), random.uniform(-20, 40)},
              {},
              static_cast<float>(random.uniform(-5, 2))};
      rotate(s, random);
      append(m, random, s);
    }
    all.push_back({scene_of("log-scales from -20 to 40, each axis on its own", m, ordinary_camera()), undecided});
  }
  {
    // Thin axes of 1e-3 at distance 3: the roundings of a ray, 2e-7 there, are 2e-4 of them, and the gradient along
    // the thin axis is off by as much, times the hits' offsets of up to 3. Now and then one Gaussian all but along a
    // pixel's ray carries its group: there one rounding of each parameter moves the gradient in double by 1e-2. Of 400
    // seeds the worst is off by 4.5e-3.
    gart::gaussian_model needles = none(), pancakes = none();
    for (int i = 0; i < 60; ++i) {
      shape s{through_image(random) * random.uniform(2, 4), {std::log(1e3), std::log(1e-3), std::log(1e-3)}, {}, 1};
      rotate(s, random);
      append(needles, random, s);
      if (i % 5) continue;  // every ray meets every pancake
      s.log_scale = {std::log(1e3), std::log(1e3), std::log(1e-3)};
      s.logit = static_cast<float>(random.uniform(-4, 0));
      rotate(s, random);
      append(pancakes, random, s);
    }
    all.push_back({scene_of("needles of 1 to 1e6", needles, ordinary_camera()), 1e-2});
    all.push_back({scene_of("pancakes of 1e6 to 1", pancakes, ordinary_camera()), 1e-2});
  }
  {
    // Thin axes of 1e-6 at distance 3, their planes through the camera and a pixel: d_g and p change by their own size
    // with one rounding of the ray. Nothing is decided but that the results are finite, and the same for all.
    gart::gaussian_model edges = none(), ends = none();
    for (int i = 0; i < 80; ++i) {
      vec3d const to = through_image(random);
      shape s{to * random.uniform(2, 4), {0, 0, std::log(1e-6)}, {}, static_cast<float>(random.uniform(-2, 2))};
      turn_z_to(s, unit(cross_of(to, in_ball(random, 1))), random);
      append(edges, random, s);
      s.log_scale = {std::log(1e-3), std::log(1e-3), std::log(1e3)};
      turn_z_to(s, to, random);
      append(ends, random, s);
    }
    all.push_back({scene_of("pancakes of 1e6 to 1, edge-on", edges, ordinary_camera()), undecided});
    all.push_back({scene_of("needles of 1 to 1e6, end-on", ends, ordinary_camera()), undecided});
  }
  {
    gart::gaussian_model m = cloud(random, 60);
    float const logits[] = {-5.5f, -5.54f, 4.6f, 6, 9, 12, 17, 25, 40, 80, 88, 1e4f, 1e30f, FLT_MAX};
    for (std::size_t i = 0; i < 30; ++i) m.opacity[2 * i] = logits[i % std::size(logits)];
    all.push_back({scene_of("sigma to its float limits", m, ordinary_camera())});
    // Thirty hits at up to 0.99 a ray: a transmittance of 1e-60 and less. Behind the first few, V - C is rounding, and
    // the gradient of opacity, which 1 - sigma makes small, shows it: of 400 seeds the worst is off by 3.5e-4.
    m = cloud(random, 90);
    for (std::size_t i = 0; i < m.size(); ++i) {
      m.opacity[i] = static_cast<float>(random.uniform(2.0, 12));
      for (int a = 0; a < 3; ++a) m.log_scale[3 * i + a] = static_cast<float>(random.uniform(-1, 0));
    }
    oracle::scene s = scene_of("transmittance to underflow", m, ordinary_camera());
    s.options.transmittance_min = 0;
    all.push_back({s, 1e-3});
  }
  {
    // Floats at 1e7 are 1 apart; the camera is not on one of them.
    gart::gaussian_model m = cloud(random, 60);
    vec3d const centre(10000000.0, -8000000.0, 3000000.0);
    for (std::size_t i = 0; i < m.mean.size(); ++i)
      m.mean[i] = static_cast<float>(centre[static_cast<int>(i % 3)] + 30 * double{m.mean[i]});
    for (float& x : m.log_scale) x += std::log(30.0f);
    oracle::scene s = scene_of("coordinates of 1e7", m, ordinary_camera());
    s.view.position = centre + vec3d(0.3, 0.7, -0.6);
    all.push_back({s});
    // A thousand times its size away, through a long lens: a rounding of the ray is 2e-4 of the size, and a tenth of
    // that of the smallest axes. On up to half of the rays it leaves the order of some two hits open.
    m = cloud(random, 60);
    for (std::size_t i = 0; i < m.size(); ++i) {
      for (int a = 0; a < 3; ++a) m.mean[3 * i + a] *= 1e4f;
      m.mean[3 * i + 2] += 1e7f;
      for (int a = 0; a < 3; ++a) m.log_scale[3 * i + a] += std::log(1e4f);
    }
    all.push_back({scene_of("1e7 away", m, looking_along_z(17, 13, 7000)), 1e-2, 0.4});
  }
  {
    gart::gaussian_model m = none();
    for (int i = 0; i < 60; ++i) {
      shape s{in_ball(random, 1) + vec3d(0, 0, 3),
              log_axes(random, 0.05, 0.6),
              {},
              static_cast<float>(random.uniform(-3, 3))};
      rotate(s, random, i % 3 == 0 ? 1.01e-4 : random.log_uniform(1.01e-4, 1e19));
      append(m, random, s);
    }
    all.push_back({scene_of("quaternions of every norm", m, ordinary_camera())});
  }
  for (float const near : {0.01f, 1e-6f}) {
    // Around, on and beside the camera: means on its very centre, surfaces through it, and shapes across the near
    // plane.
    gart::gaussian_model m = none();
    for (int i = 0; i < 60; ++i) {
      shape s{{0, 0, 0}, log_axes(random, 0.2, 4), {}, static_cast<float>(random.uniform(-4, 1))};
      rotate(s, random);
      if (i % 4 == 1) {  // |p| = 1, 2 or 3 at the camera
        s.log_scale = vec3d(std::log(random.log_uniform(0.05, 2)));
        s.mean = unit(in_ball(random, 1)) * (std::exp(s.log_scale.x) * (1 + i % 3));
      }
      if (i % 4 == 2) s.mean = {random.uniform(-1, 1), random.uniform(-1, 1), near};
      if (i % 4 == 3) s.mean = in_ball(random, 2);
      append(m, random, s);
    }
    oracle::scene s =
        scene_of(near < 0.01f ? "around the camera, a near plane of 1e-6" : "around the camera", m, ordinary_camera());
    s.options.near = near;
    all.push_back({s});
  }
  {
    // The ray of each pixel passes some Gaussian where |p| is its cut-off to a few roundings, on either side.
    gart::gaussian_model m = none();
    gart::camera const c = ordinary_camera();
    for (int i = 0; i < 200; ++i) {
      int const x = static_cast<int>(random.uniform(0, c.width)), y = static_cast<int>(random.uniform(0, c.height));
      auto const ray = oracle::ray_through(c, x, y);
      vec3d const d(ray.x, ray.y, ray.z);
      double const sigma = random.uniform(0.02, 0.5), size = random.log_uniform(1e-3, 0.3);
      shape s{{0, 0, 0}, log_axes(random, size, 3 * size), {}, static_cast<float>(std::log(sigma / (1 - sigma)))};
      rotate(s, random);
      // |p| is proportional to the distance off the ray.
      vec3d const off = unit(cross_of(d, in_ball(random, 1)));
      double const cutoff = std::sqrt(2 * std::log(sigma * 255)) * (1 + random.uniform(-1, 1) * 1e-6);
      s.mean = d * random.uniform(1, 5) + off * (cutoff / offset_of(s, off, d));
      append(m, random, s);
    }
    all.push_back({scene_of("rays that graze", m, c), 1e-4, 0});
  }
  {
    // 10,000 faint ones in a row, met by every ray.
    gart::gaussian_model m = none();
    for (int i = 0; i < 10000; ++i) {
      shape s{{random.uniform(-0.02, 0.02), random.uniform(-0.02, 0.02), random.uniform(2, 40)},
              log_axes(random, 0.3, 0.6),
              {},
              static_cast<float>(random.uniform(-9.5, -8))};
      rotate(s, random);
      append(m, random, s);
    }
    brighten(m);
    oracle::scene s = scene_of("10,000 hits on a ray", m, looking_along_z(3, 1, 1000));
    s.options.alpha_min = 1e-6f, s.options.transmittance_min = 0;
    all.push_back({s, 1e-3});  // the sums V and C have seen 10,000 roundings by its end
  }
  {
    // Three thousand on one centre: one shape 2,000 times (ties, by id), and 1,000 others between them.
    gart::gaussian_model m = none();
    shape const copied{{0.01, -0.02, 3}, {-1, -1.5, -2}, {0.2, -0.8, 0.5, 0.1}, 0};
    for (int i = 0; i < 3000; ++i) {
      shape s = copied;
      if (i % 3 == 1) s.log_scale = log_axes(random, 0.1, 0.6), rotate(s, random);
      s.logit = static_cast<float>(random.uniform(-7.5, -6));
      append(m, random, s);
    }
    brighten(m);
    oracle::scene scene = scene_of("3,000 on one centre", m, looking_along_z(3, 3, 40));
    scene.options.alpha_min = 1e-6f;
    all.push_back({scene, 1e-3, 0.2});  // as above; where many others tie within rounding, nothing is decided
  }
  for (auto const& [width, height] : {std::pair{1, 1}, {1, 7}, {65, 9}, {8192, 1}, {2, 8192}}) {
    gart::gaussian_model const m = cloud(random, 40);
    int const wide = std::max(width, height);
    all.push_back({scene_of(std::to_string(width) + " x " + std::to_string(height), m,
                            looking_along_z(width, height, static_cast<float>(wide)))});
    all.back().decided = 0.5;
  }
  {
    all.push_back({scene_of("no Gaussian", none(), ordinary_camera())});
    // Its opacity's gradient is one sum: of terms of either sign, now and then it has lost all its digits.
    oracle::scene one = scene_of("one Gaussian", cloud(random, 1), ordinary_camera());
    one.options.background = vec3(0.0f);
    all.push_back({one, 1e-4, 0.9, 0});
    gart::gaussian_model m = cloud(random, 40);
    for (std::size_t i = 0; i < m.size(); ++i) m.mean[3 * i + 2] *= -1;
    all.push_back({scene_of("all behind the camera", m, ordinary_camera())});
    // 173 degrees across.
    m = none();
    for (int i = 0; i < 80; ++i) {
      shape s{in_ball(random, 3), log_axes(random, 0.1, 0.6), {}, static_cast<float>(random.uniform(-3, 3))};
      rotate(s, random);
      append(m, random, s);
    }
    all.push_back({scene_of("a field of view of 173 degrees", m, looking_along_z(17, 13, 0.5f))});
  }
  return all;
}

}  // namespace gart_test
