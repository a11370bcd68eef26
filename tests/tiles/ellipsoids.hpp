#pragma once
// Random cameras, and random Gaussians placed in a camera's own axes: ordinary ones and every extreme at which bounds
// of a projected ellipsoid are known to go wrong.

#include <gart/scene/camera.hpp>
#include <gart/scene/parameters.hpp>

#include <cmath>
#include <random>
#include <vector>

namespace gart_test {

enum class placement {
  ordinary,
  across_near_plane,
  around_camera,
  behind,
  needle,
  pancake,
  near_tip,
  sub_pixel,
  whole_screen,
  far_away,
  any_scale,
  far_from_origin,
  tiny_near,
  lens,
  count
};

inline char const* name_of(placement p) {
  constexpr char const* names[] = {"ordinary",
                                   "across the near plane",
                                   "around the camera",
                                   "behind",
                                   "needle",
                                   "pancake",
                                   "near tip",
                                   "sub-pixel",
                                   "whole screen",
                                   "far away",
                                   "any scale",
                                   "far from the origin",
                                   "tiny near",
                                   "distorted lens"};
  return names[static_cast<int>(p)];
}

class ellipsoid_source {
 public:
  explicit ellipsoid_source(std::uint64_t seed) : random_(seed) {}

  double uniform(double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random_); }
  double log_uniform(double lo, double hi) { return std::exp(uniform(std::log(lo), std::log(hi))); }
  bool chance(double p) { return uniform(0, 1) < p; }

  gart::quaternion rotation() {
    std::normal_distribution<float> n;
    return {n(random_), n(random_), n(random_), n(random_)};
  }

  float near_distance(placement p) {
    if (p == placement::tiny_near) return static_cast<float>(log_uniform(1e-7, 1e-4));
    return chance(0.5) ? 0.01f : static_cast<float>(log_uniform(1e-3, 0.5));
  }

  gart::camera camera(placement p) {
    gart::camera c;
    c.width = chance(0.5) ? 64 : static_cast<int>(uniform(40, 70));
    c.height = chance(0.5) ? 48 : static_cast<int>(uniform(30, 60));
    bool const distorted = p == placement::lens;
    c.fx = static_cast<float>(distorted ? uniform(40, 80) : log_uniform(15, 300));
    c.fy = c.fx * static_cast<float>(uniform(0.9, 1.1));
    c.cx = static_cast<float>(c.width * uniform(0.4, 0.6)), c.cy = static_cast<float>(c.height * uniform(0.4, 0.6));
    if (distorted) {
      // One to one over the whole image.
      c.lens.k1 = static_cast<float>(uniform(-0.1, 0.2)), c.lens.k2 = static_cast<float>(uniform(0, 0.05));
      c.lens.p1 = static_cast<float>(uniform(-0.01, 0.01)), c.lens.p2 = static_cast<float>(uniform(-0.01, 0.01));
    }
    c.rotation = gart::to_matrix(rotation());
    double const distance = p == placement::far_from_origin ? log_uniform(1e5, 1e7) : uniform(0, 5);
    gart::vec3 const direction = gart::to_matrix(rotation())[0];
    c.position = gart::vec3d(direction) * distance;
    return c;
  }

  gart::gaussian_parameters gaussian(placement p, gart::camera const& c) {
    gart::gaussian_parameters g{};
    g.mean = g.log_scale = gart::vec3(0.0f);
    g.rotation = rotation();
    g.opacity = static_cast<float>(chance(0.1) ? uniform(-6, -4) : uniform(-3, 8));
    double z = log_uniform(0.5, 30), scale = 0.1;
    gart::vec3d at;
    gart::vec3d aspect(log_uniform(0.3, 1), log_uniform(0.1, 1), 1);
    if (p == placement::lens && chance(0.3)) p = placement::across_near_plane;
    switch (p) {
      case placement::across_near_plane:
        scale = log_uniform(0.02, 5);
        at = gart::vec3d(uniform(-4, 4), uniform(-4, 4), uniform(-3, 3)) * scale;
        return placed(g, c, at, aspect * scale);
      case placement::around_camera:
        scale = log_uniform(0.02, 100);
        at = gart::vec3d(uniform(-0.5, 0.5), uniform(-0.5, 0.5), uniform(-0.5, 0.5)) * scale * 0.3;
        return placed(g, c, at, aspect * scale);
      case placement::behind:
        scale = log_uniform(0.01, 5);
        return placed(g, c, {uniform(-5, 5), uniform(-5, 5), uniform(-10, -0.1)}, aspect * scale);
      case placement::tiny_near:
        scale = log_uniform(1e-6, 1);
        at = gart::vec3d(uniform(-3, 3), uniform(-3, 3), uniform(-2, 4)) * scale;
        return placed(g, c, at, aspect * scale);
      case placement::needle:
        scale = z * log_uniform(0.01, 2);
        aspect = {log_uniform(1e-6, 1e-2), log_uniform(1e-6, 1e-2), 1};
        break;
      case placement::pancake:
        scale = z * log_uniform(0.01, 2);
        aspect = {uniform(0.3, 1), 1, log_uniform(1e-6, 1e-2)};
        break;
      case placement::near_tip: {
        // A long needle with its end before the camera and its centre far away: the roundings of the centre's distance
        // are large beside the end's.
        gart::vec3d const tip = gart::vec3d(uniform(-0.4, 0.4), uniform(-0.4, 0.4), 1) * log_uniform(0.05, 0.5);
        double const cutoff = gart::hit_cutoff(g, 1.0f / 255);
        scale = log_uniform(1, 1e5);
        gart::vec3d const along(gart::to_matrix(rotation())[2]);
        at = tip + along * (scale * std::sqrt(cutoff > 0 ? cutoff : 1.0));
        align(g, c, along, true);
        return placed(g, c, at, {tip.z * log_uniform(1e-3, 0.1), tip.z * log_uniform(1e-3, 0.1), scale});
      }
      case placement::sub_pixel:
        scale = z * log_uniform(1e-7, 3e-3);
        break;
      case placement::whole_screen:
        scale = z * log_uniform(1, 100);
        break;
      case placement::far_away:
        z = log_uniform(1e3, 1e5);
        scale = z * log_uniform(1e-6, 1);
        break;
      case placement::any_scale:
        z = (chance(0.3) ? -1 : 1) * log_uniform(1e-3, 1e4);
        scale = 1;
        aspect = {log_uniform(2e-9, 2.2e4), log_uniform(2e-9, 2.2e4), log_uniform(2e-9, 2.2e4)};
        break;
      default:
        scale = z * log_uniform(0.01, 0.2);
        break;
    }
    // Somewhere in the image or a little beside it.
    at = {(uniform(-0.2, 1.2) * c.width - c.cx) / c.fx * z, (uniform(-0.2, 1.2) * c.height - c.cy) / c.fy * z, z};
    if ((p == placement::needle || p == placement::pancake) && chance(0.5)) align(g, c, at, p == placement::needle);
    return placed(g, c, at, aspect * scale);
  }

 private:
  // A needle's long axis along the view ray, or a pancake's thin axis across it: edge-on.
  void align(gart::gaussian_parameters& g, gart::camera const& c, gart::vec3d const& at, bool along) {
    gart::vec3d to = gart::mat3d(c.rotation) * at;
    to = to / std::sqrt(to.x * to.x + to.y * to.y + to.z * to.z);
    if (!along) {
      gart::vec3d const other(gart::to_matrix(rotation())[0]);
      to = {to.y * other.z - to.z * other.y, to.z * other.x - to.x * other.z, to.x * other.y - to.y * other.x};
      to = to / std::sqrt(to.x * to.x + to.y * to.y + to.z * to.z);
    }
    if (to.z < -0.999) return;
    // The shortest rotation from z, of any norm.
    g.rotation = {static_cast<float>(1 + to.z), static_cast<float>(-to.y), static_cast<float>(to.x), 0};
  }

  static gart::gaussian_parameters placed(gart::gaussian_parameters g, gart::camera const& c, gart::vec3d const& at,
                                          gart::vec3d const& scale) {
    g.mean = gart::vec3(c.position + gart::mat3d(c.rotation) * at);
    for (int k = 0; k < 3; ++k) g.log_scale[k] = static_cast<float>(std::log(scale[k]));
    return g;
  }

  std::mt19937_64 random_;
};

inline void append(gart::gaussian_model& m, gart::gaussian_parameters const& g) {
  for (int k = 0; k < 3; ++k) m.mean.push_back(g.mean[k]), m.log_scale.push_back(g.log_scale[k]);
  for (float q : {g.rotation.w, g.rotation.x, g.rotation.y, g.rotation.z}) m.quaternion.push_back(q);
  m.opacity.push_back(g.opacity);
  m.sh.insert(m.sh.end(), 3 * gart::sh_coefficients(m.sh_degree), 0.0f);
}

}  // namespace gart_test
