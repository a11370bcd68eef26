#pragma once
// Traces pixels in double (reference.hpp has the definitions). It has the Gaussians relative to the camera. A cone
// culls most of them for a block of pixels. It has a ray's hits in order, compositing and its gradient.

#include "rays.hpp"

#include <gart/reference/reference.hpp>

#include <algorithm>
#include <cmath>
#include <vector>

namespace gart::by_definition {

constexpr int block_side = 16;
constexpr double opaque = 0.99;
constexpr int most_coefficients = 16;

inline double dot(vec3d const& a, vec3d const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length(vec3d const& a) { return std::sqrt(dot(a, a)); }
inline vec3d cross(vec3d const& a, vec3d const& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// The real spherical harmonics in the order and with the signs of splat files.
struct harmonics {
  double y[most_coefficients];
  explicit harmonics(vec3d const& d) {
    double const a = d.x, b = d.y, c = d.z, aa = a * a, bb = b * b, cc = c * c;
    double const values[most_coefficients] = {
        0.28209479177387814,
        -0.4886025119029199 * b,
        0.4886025119029199 * c,
        -0.4886025119029199 * a,
        1.0925484305920792 * a * b,
        -1.0925484305920792 * b * c,
        0.31539156525252005 * (2 * cc - aa - bb),
        -1.0925484305920792 * a * c,
        0.5462742152960396 * (aa - bb),
        -0.5900435899266435 * b * (3 * aa - bb),
        2.890611442640554 * a * b * c,
        -0.4570457994644658 * b * (4 * cc - aa - bb),
        0.3731763325901154 * c * (2 * cc - 3 * aa - 3 * bb),
        -0.4570457994644658 * a * (4 * cc - aa - bb),
        1.445305721320277 * c * (aa - bb),
        -0.5900435899266435 * a * (aa - 3 * bb),
    };
    std::copy(values, values + most_coefficients, y);
  }
};

// One Gaussian, relative to the camera's centre.
struct body {
  vec3d mean, inverse_scale;
  double w;  // the unit quaternion (w, axis)
  vec3d axis;
  double norm;  // of the quaternion as stored
  double sigma;
  // Of the sphere around all hits, seen from the camera: direction, and the sine and cosine of its angular radius.
  vec3d direction;
  double sine, cosine, radius, distance;
  bool around_camera;
  bool valid = false;

  // R v and R^T v, by the quaternion itself.
  vec3d rotate(vec3d const& v) const { return v + 2 * w * cross(axis, v) + 2.0 * cross(axis, cross(axis, v)); }
  vec3d rotate_back(vec3d const& v) const { return v - 2 * w * cross(axis, v) + 2.0 * cross(axis, cross(axis, v)); }
  vec3d to_unit(vec3d const& v) const { return rotate_back(v) * inverse_scale; }
  // A ray's origin in the body's space, o_g.
  vec3d origin_of(pixel_ray const& r) const { return to_unit(r.origin - mean); }
};

// rho = exp(-4.5 (|p| / 3)^n).
struct kernel {
  int degree;
  double response(double p2) const { return std::exp(-4.5 * std::pow(p2 / 9, 0.5 * degree)); }
  // -2 d ln rho / d |p|^2; at the cusp of degree 1, which has no direction there, none.
  double slope(double p2) const { return p2 > 0 || degree > 1 ? 0.5 * degree * std::pow(p2 / 9, 0.5 * degree - 1) : 0; }
  // The largest |p| with ratio * rho >= 1.
  double reach(double ratio) const { return 3 * std::pow(std::log(ratio) / 4.5, 1.0 / degree); }
};

// The cone around some rays, that begin in a ball about the camera's position.
struct cone {
  vec3d axis{0.0};
  double sine = 0, cosine = 1, ball = 0;
  bool everything;

  cone(std::vector<pixel_ray> const& rays, std::vector<u32> const& members, bool backwards_too) {
    for (u32 const k : members) axis += rays[k].direction, ball = std::max(ball, length(rays[k].origin));
    axis /= std::max(length(axis), 1e-300);
    for (u32 const k : members)
      if (dot(rays[k].direction, rays[k].direction) > 0) cosine = std::min(cosine, dot(axis, rays[k].direction));
    sine = std::sqrt(std::max(0.0, (1 - cosine) * (1 + cosine)));
    // A cone of a right angle and more, or rays that are hit behind their origin: no test.
    everything = !(cosine > 1e-3) || backwards_too;
  }
  // The angle between the axes is at most the sum of the half-angles, less what double may round. Seen from a ball in
  // place of a point, a sphere is as much larger.
  bool may_meet(body const& g) const {
    if (!g.valid) return false;
    if (everything || g.around_camera || !(g.radius + ball < g.distance)) return true;
    double const share = (g.radius + ball) / g.distance;
    double const own_sine = ball > 0 ? share : g.sine, own = ball > 0 ? std::sqrt((1 - share) * (1 + share)) : g.cosine;
    return dot(axis, g.direction) >= cosine * own - sine * own_sine - 1e-9;
  }
};

struct reference_hit {
  double t, alpha, raw;  // raw: before the clamp at 0.99
  u32 id;
  vec3d p, color;
  u32 clamped = 0;           // bit c: colour channel c is held at 0
  double transmittance = 1;  // before the hit
};

class pixel_tracer {
 public:
  pixel_tracer(gaussian_model const& model, render_options const& options, int active_degree, kernel const& k,
               std::vector<body> const& bodies)
      : model_(model),
        options_(options),
        kernel_(k),
        bodies_(bodies),
        stored_(static_cast<std::size_t>(sh_coefficients(model.sh_degree))),
        active_(static_cast<std::size_t>(sh_coefficients(active_degree))) {}

  // The hits that count, in order.
  std::vector<reference_hit> hits(pixel_ray const& ray, harmonics const& basis,
                                  std::vector<u32> const& candidates) const {
    std::vector<reference_hit> list;
    double const alpha_min = options_.alpha_min, near = options_.near;
    for (u32 const id : candidates) {
      body const& g = bodies_[id];
      vec3d const d_g = g.to_unit(ray.direction), o_g = g.origin_of(ray);
      reference_hit h;
      h.id = id;
      h.t = -dot(o_g, d_g) / dot(d_g, d_g);
      h.p = o_g + h.t * d_g;
      h.raw = g.sigma * kernel_.response(dot(h.p, h.p));
      h.alpha = std::min(opaque, h.raw);
      if (h.alpha >= alpha_min && h.t > near) list.push_back(h);
    }
    std::sort(list.begin(), list.end(),
              [](reference_hit const& a, reference_hit const& b) { return a.t < b.t || (a.t == b.t && a.id < b.id); });
    double transmittance = 1;
    std::size_t count = 0;
    while (count < list.size()) {
      reference_hit& h = list[count++];
      shade(h, basis);
      h.transmittance = transmittance;
      transmittance *= 1 - h.alpha;
      if (transmittance < options_.transmittance_min || count == options_.max_hits) break;
    }
    list.resize(count);
    return list;
  }

  void composite(std::vector<reference_hit> const& list, std::size_t at, reference_image& out) const {
    vec3d color(0.0);
    double transmittance = 1, depth = 0;
    for (reference_hit const& h : list) {
      color += h.transmittance * h.alpha * h.color;
      depth += h.transmittance * h.alpha * h.t;
      transmittance = h.transmittance * (1 - h.alpha);
    }
    for (int c = 0; c < 3; ++c) out.color[3 * at + c] = color[c] + transmittance * options_.background[c];
    out.transmittance[at] = transmittance, out.depth[at] = depth, out.hits[at] = static_cast<u32>(list.size());
  }

  // Adds the gradient of one pixel; slots of `sums` are the places of Gaussians in `slot`.
  template <class Sums>
  void differentiate(std::vector<reference_hit> const& list, pixel_ray const& ray, harmonics const& basis,
                     vec3d const& g, double by_depth, Sums&& sums) const {
    vec3d behind(options_.background);
    double depth_behind = 0;
    for (std::size_t i = list.size(); i-- > 0;) {
      reference_hit const& h = list[i];
      double* const to = sums(h.id);
      double const weight = h.transmittance * h.alpha;
      for (int c = 0; c < 3; ++c) {
        if (h.clamped >> c & 1) continue;
        for (std::size_t k = 0; k < active_; ++k) to[11 + 3 * k + c] += weight * g[c] * basis.y[k];
      }
      double const by_alpha = h.transmittance * (dot(g, h.color - behind) + by_depth * (h.t - depth_behind));
      if (h.raw < opaque) add_geometry(bodies_[h.id], h, ray, h.raw * by_alpha, to);
      if (by_depth != 0) add_distance(bodies_[h.id], h, ray, weight * by_depth, to);
      depth_behind = h.alpha * h.t + (1 - h.alpha) * depth_behind;
      behind = h.alpha * h.color + (1 - h.alpha) * behind;
    }
  }

  std::size_t stored() const { return stored_; }

 private:
  void shade(reference_hit& h, harmonics const& basis) const {
    float const* const sh = &model_.sh[3 * stored_ * h.id];
    for (int c = 0; c < 3; ++c) {
      double sum = 0.5;
      for (std::size_t k = 0; k < active_; ++k) sum += basis.y[k] * sh[3 * k + c];
      if (!(sum > 0)) h.clamped |= 1u << c;
      h.color[c] = std::max(0.0, sum);
    }
  }

  // alpha = sigma rho(|p|) with p = S^-1 R^T (o + t d - mean). At t |p| is least, so moving t changes nothing. `a` is
  // alpha dL/dalpha. to: mean, log-scale, quaternion, opacity.
  void add_geometry(body const& g, reference_hit const& h, pixel_ray const& ray, double a, double* to) const {
    double const b = a * kernel_.slope(dot(h.p, h.p));
    vec3d const by_body = -b * h.p * g.inverse_scale;  // dL by R^T (o + t d - mean)
    vec3d const by_point = g.rotate(by_body), x = ray.origin + h.t * ray.direction - g.mean;
    for (int k = 0; k < 3; ++k) to[k] -= by_point[k], to[3 + k] += b * h.p[k] * h.p[k];
    add_rotation(g, x, by_body, to);
    to[10] += a * (1 - g.sigma);
  }

  // t = -o_g.d_g / d_g.d_g with o_g = S^-1 R^T (o - mean) and d_g = S^-1 R^T d, by both. `a` is dL/dt.
  void add_distance(body const& g, reference_hit const& h, pixel_ray const& ray, double a, double* to) const {
    vec3d const d_g = g.to_unit(ray.direction), o_g = g.origin_of(ray), moved = h.p + h.t * d_g;
    double const e = -a / dot(d_g, d_g);
    vec3d const by_origin = e * d_g * g.inverse_scale, by_direction = e * moved * g.inverse_scale;
    vec3d const by_camera = g.rotate(by_origin);
    for (int k = 0; k < 3; ++k) to[k] -= by_camera[k], to[3 + k] -= e * (o_g[k] + moved[k]) * d_g[k];
    add_rotation(g, ray.origin - g.mean, by_origin, to), add_rotation(g, ray.direction, by_direction, to);
  }

  // x . R v with R v = v + 2 w u x v + 2 u x (u x v), by (w, u). Then through the division by the norm.
  static void add_rotation(body const& g, vec3d const& x, vec3d const& v, double* to) {
    vec3d const& u = g.axis;
    double by_w = 2 * dot(x, cross(u, v));
    vec3d by_u = 2 * g.w * cross(v, x) + 2.0 * (x * dot(u, v) + v * dot(u, x) - 2.0 * u * dot(x, v));
    double const along = by_w * g.w + dot(by_u, u);
    by_w -= along * g.w, by_u -= along * u;
    to[6] += by_w / g.norm;
    for (int k = 0; k < 3; ++k) to[7 + k] += by_u[k] / g.norm;
  }

  gaussian_model const& model_;
  render_options const& options_;
  kernel kernel_;
  std::vector<body> const& bodies_;
  std::size_t stored_, active_;
};

// Sums of the Gaussians that a block meets, 11 of geometry and 3 a coefficient each.
class block_sums {
 public:
  block_sums(std::size_t gaussians_met, std::size_t stored) : row_(11 + 3 * stored), sums_(row_ * gaussians_met) {}
  double* at(std::size_t slot) { return &sums_[row_ * slot]; }

  void add_to(reference_gradients& out, std::vector<u32> const& candidates) const {
    for (std::size_t slot = 0; slot < candidates.size(); ++slot) {
      double const* from = &sums_[row_ * slot];
      std::size_t const i = candidates[slot], bands = row_ - 11;
      for (int k = 0; k < 3; ++k) out.mean[3 * i + k] += from[k], out.log_scale[3 * i + k] += from[3 + k];
      for (int k = 0; k < 4; ++k) out.quaternion[4 * i + k] += from[6 + k];
      out.opacity[i] += from[10];
      for (std::size_t k = 0; k < bands; ++k) out.sh[bands * i + k] += from[11 + k];
    }
  }

 private:
  std::size_t row_;
  std::vector<double> sums_;
};

}  // namespace gart::by_definition
