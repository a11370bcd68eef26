#include <gart/core/error.hpp>
#include <gart/reference/reference.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>
#include <string>

namespace gart {

namespace {

constexpr int block_side = 16;
constexpr double opaque = 0.99;
constexpr int most_coefficients = 16;

double dot(vec3d const& a, vec3d const& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
double length(vec3d const& a) { return std::sqrt(dot(a, a)); }
vec3d cross(vec3d const& a, vec3d const& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Where the lens model sends an undistorted point, less `target`, and the derivatives of that.
struct lens_error {
  double x, y, xx, xy, yy;
};

lens_error lens_error_at(distortion const& lens, double x, double y, double target_x, double target_y) {
  double const k1 = lens.k1, k2 = lens.k2, p1 = lens.p1, p2 = lens.p2, r2 = x * x + y * y;
  double const radial = 1 + k1 * r2 + k2 * r2 * r2, slope = 2 * k1 + 4 * k2 * r2;
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) - target_x,
          y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y) - target_y,
          radial + slope * x * x + 2 * p1 * y + 6 * p2 * x, slope * x * y + 2 * p1 * x + 2 * p2 * y,
          radial + slope * y * y + 2 * p2 * x + 6 * p1 * y};
}

struct point {
  double x, y;
  bool converged;
};

point undistorted(camera const& view, double u, double v) {
  double const target_x = (u - view.cx) / view.fx, target_y = (v - view.cy) / view.fy;
  double x = target_x, y = target_y;
  bool converged = !view.lens.any();
  for (int i = 0; i < 100 && !converged; ++i) {
    lens_error const e = lens_error_at(view.lens, x, y, target_x, target_y);
    double const det = e.xx * e.yy - e.xy * e.xy;
    x -= (e.x * e.yy - e.y * e.xy) / det, y -= (e.y * e.xx - e.x * e.xy) / det;
    converged = std::abs(e.x) + std::abs(e.y) < 1e-14 * (1 + std::abs(target_x) + std::abs(target_y));
  }
  return {x, y, converged};
}

vec3d ray_through(camera const& view, u32 pixel) {
  u32 const width = static_cast<u32>(view.width);
  auto const [x, y, converged] = undistorted(view, pixel % width + 0.5, pixel / width + 0.5);
  if (!converged) {
    throw invalid_argument("reference: the lens cannot be inverted at pixel (" + std::to_string(pixel % width) + ", " +
                           std::to_string(pixel / width) + "); leave it out, or undistort the capture");
  }
  vec3d d(0.0);
  double const point[3] = {x, y, 1};
  for (int axis = 0; axis < 3; ++axis)
    for (int k = 0; k < 3; ++k) d[k] += static_cast<double>(view.rotation[axis][k]) * point[axis];
  return d / length(d);
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

// The filter of a view's pixels, of numbers that may be complex: a derivative is then the imaginary part of a value at
// a point moved by an imaginary step, without a difference and exact to double.
class filter {
 public:
  filter(camera const& view, double pixels) : view_(view), pixels_(pixels) {
    if (!any()) return;
    constexpr int steps = 64;
    for (int k = 0; k <= steps; ++k) {
      double const u = view.width * (k / double{steps}), v = view.height * (k / double{steps});
      for (auto const& [at_u, at_v] : {std::pair{u, 0.0}, {u, 1.0 * view.height}, {0.0, v}, {1.0 * view.width, v}}) {
        point const p = undistorted(view, at_u, at_v);
        x0_ = std::min(x0_, p.x), x1_ = std::max(x1_, p.x), y0_ = std::min(y0_, p.y), y1_ = std::max(y1_, p.y);
      }
    }
  }
  bool any() const { return pixels_ > 0; }

  // mean (from the camera), log-scale, quaternion, opacity; of the result the quaternion is not set.
  template <class T>
  struct parameters {
    T mean[3], log_scale[3], quaternion[4], opacity;
  };

  // Log-scales and logit of sigma as the pixels see them.
  template <class T>
  parameters<T> seen(parameters<T> const& g) const {
    T const* const q = g.quaternion;
    T const norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    T const* const m = g.mean;
    T const variance = pixels_ * pixels_ * solid_angle(m) * (m[0] * m[0] + m[1] * m[1] + m[2] * m[2]);
    // R^T m = m - 2 w u x m + 2 u x (u x m).
    T const w = q[0] / norm, u[3] = {q[1] / norm, q[2] / norm, q[3] / norm};
    T turned[3], once[3];
    for (int k = 0; k < 3; ++k) once[k] = u[(k + 1) % 3] * m[(k + 2) % 3] - u[(k + 2) % 3] * m[(k + 1) % 3];
    for (int k = 0; k < 3; ++k) {
      T const twice = u[(k + 1) % 3] * once[(k + 2) % 3] - u[(k + 2) % 3] * once[(k + 1) % 3];
      turned[k] = m[k] - 2.0 * w * once[k] + 2.0 * twice;
    }
    parameters<T> out = g;
    T product = 1.0, narrow = 0.0, wide = 0.0;
    for (int k = 0; k < 3; ++k) {
      T const square = std::exp(2.0 * g.log_scale[k]);
      out.log_scale[k] = 0.5 * std::log(square + variance);
      product *= square / (square + variance);
      narrow += turned[k] * turned[k] / square, wide += turned[k] * turned[k] / (square + variance);
    }
    // 1 - sigma' = (1 - sigma) + sigma (1 - factor)
    T const factor = std::sqrt(product * narrow / wide), sigma = 1.0 / (1.0 + std::exp(-g.opacity));
    T const rest = 1.0 / (1.0 + std::exp(g.opacity)) + sigma * (1.0 - factor);
    out.opacity = std::log(sigma * factor) - std::log(rest);
    return out;
  }

 private:
  template <class T>
  T solid_angle(T const* m) const {
    T side[3] = {0.0, 0.0, 0.0};
    for (int axis = 0; axis < 3; ++axis)
      for (int k = 0; k < 3; ++k) side[axis] += static_cast<double>(view_.rotation[axis][k]) * m[k];
    T const x = between(side[0], side[2], x0_, x1_), y = between(side[1], side[2], y0_, y1_);
    distortion const& l = view_.lens;
    double const k1 = l.k1, k2 = l.k2, p1 = l.p1, p2 = l.p2;
    T const r2 = x * x + y * y, radial = 1.0 + k1 * r2 + k2 * r2 * r2, slope = 2.0 * k1 + 4.0 * k2 * r2;
    T const xx = radial + slope * x * x + 2.0 * p1 * y + 6.0 * p2 * x, xy = slope * x * y + 2.0 * (p1 * x + p2 * y);
    T const yy = radial + slope * y * y + 2.0 * p2 * x + 6.0 * p1 * y;
    return 1.0 / (std::pow(1.0 + r2, 1.5) * static_cast<double>(view_.fx) * static_cast<double>(view_.fy) *
                  (xx * yy - xy * xy));
  }
  template <class T>
  static T between(T side, T z, double lo, double hi) {
    if (!(std::real(z) > 0)) return std::real(side) < 0 ? lo : hi;
    T const slope = side / z;
    return std::real(slope) < lo ? T(lo) : std::real(slope) > hi ? T(hi) : slope;
  }

  camera const& view_;
  double pixels_;
  double x0_ = 1e300, x1_ = -1e300, y0_ = 1e300, y1_ = -1e300;
};

// One Gaussian, relative to the camera's centre.
struct body {
  vec3d mean, inverse_scale, origin;  // origin: the camera in the body's space, o_g
  double w;                           // the unit quaternion (w, axis)
  vec3d axis;
  double norm;  // of the quaternion as stored
  double sigma;
  // Of the sphere around all hits, seen from the camera: direction, and the sine and cosine of its angular radius.
  vec3d direction;
  double sine, cosine;
  bool around_camera;
  bool valid = false;

  // R v and R^T v, by the quaternion itself.
  vec3d rotate(vec3d const& v) const { return v + 2 * w * cross(axis, v) + 2.0 * cross(axis, cross(axis, v)); }
  vec3d rotate_back(vec3d const& v) const { return v - 2 * w * cross(axis, v) + 2.0 * cross(axis, cross(axis, v)); }
  vec3d to_unit(vec3d const& v) const { return rotate_back(v) * inverse_scale; }
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

filter::parameters<double> stored_parameters(gaussian_model const& m, std::size_t i, vec3d const& camera) {
  filter::parameters<double> out;
  for (int c = 0; c < 3; ++c) out.mean[c] = m.mean[3 * i + c] - camera[c], out.log_scale[c] = m.log_scale[3 * i + c];
  for (int c = 0; c < 4; ++c) out.quaternion[c] = m.quaternion[4 * i + c];
  out.opacity = m.opacity[i];
  return out;
}

body body_of(gaussian_model const& m, std::size_t i, vec3d const& camera, double alpha_min, kernel const& k,
             filter const& pixels) {
  body g;
  float const* const values[] = {&m.mean[3 * i], &m.log_scale[3 * i], &m.quaternion[4 * i], &m.opacity[i]};
  int const counts[] = {3, 3, 4, 1};
  for (int group = 0; group < 4; ++group)
    for (int c = 0; c < counts[group]; ++c)
      if (!std::isfinite(values[group][c])) return g;
  double largest = 0;
  for (int c = 0; c < 3; ++c) {
    double const s = m.log_scale[3 * i + c];
    if (!(s > -40 && s < 40)) return g;
    g.mean[c] = m.mean[3 * i + c] - camera[c];
  }
  double const q[4] = {m.quaternion[4 * i], m.quaternion[4 * i + 1], m.quaternion[4 * i + 2], m.quaternion[4 * i + 3]};
  double const norm2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
  auto const shown =
      pixels.any() && norm2 > 1e-8 ? pixels.seen(stored_parameters(m, i, camera)) : stored_parameters(m, i, camera);
  for (int c = 0; c < 3; ++c) {
    g.inverse_scale[c] = std::exp(-shown.log_scale[c]);
    largest = std::max(largest, std::exp(shown.log_scale[c]));
  }
  g.sigma = 1 / (1 + std::exp(-shown.opacity));
  if (!(norm2 > 1e-8) || !(g.sigma >= alpha_min)) return g;
  g.norm = std::sqrt(norm2);
  g.w = q[0] / g.norm, g.axis = vec3d(q[1], q[2], q[3]) / g.norm;
  g.origin = g.to_unit(-g.mean);
  // |x - mean| <= |p| times the largest scale.
  double const radius = 1.000001 * largest * k.reach(g.sigma / alpha_min), distance = length(g.mean);
  g.around_camera = !(radius < distance);
  g.valid = true;
  if (g.around_camera) return g;
  g.direction = g.mean / distance;
  g.sine = radius / distance, g.cosine = std::sqrt((1 - g.sine) * (1 + g.sine));
  return g;
}

// The cone around some rays from the camera.
struct cone {
  vec3d axis{0.0};
  double sine = 0, cosine = 1;
  bool everything;

  cone(std::vector<vec3d> const& rays, std::vector<u32> const& members, bool backwards_too) {
    for (u32 const k : members) axis += rays[k];
    axis /= length(axis);
    for (u32 const k : members) cosine = std::min(cosine, dot(axis, rays[k]));
    sine = std::sqrt(std::max(0.0, (1 - cosine) * (1 + cosine)));
    // A cone of a right angle and more, or rays that are hit behind their origin: no test.
    everything = !(cosine > 1e-3) || backwards_too;
  }
  // The angle between the axes is at most the sum of the half-angles, less what double may round.
  bool may_meet(body const& g) const {
    return g.valid &&
           (everything || g.around_camera || dot(axis, g.direction) >= cosine * g.cosine - sine * g.sine - 1e-9);
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
  std::vector<reference_hit> hits(vec3d const& d, harmonics const& basis, std::vector<u32> const& candidates) const {
    std::vector<reference_hit> list;
    double const alpha_min = options_.alpha_min, near = options_.near;
    for (u32 const id : candidates) {
      body const& g = bodies_[id];
      vec3d const d_g = g.to_unit(d);
      reference_hit h;
      h.id = id;
      h.t = -dot(g.origin, d_g) / dot(d_g, d_g);
      h.p = g.origin + h.t * d_g;
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
  void differentiate(std::vector<reference_hit> const& list, vec3d const& d, harmonics const& basis, vec3d const& g,
                     Sums&& sums) const {
    vec3d behind(options_.background);
    for (std::size_t i = list.size(); i-- > 0;) {
      reference_hit const& h = list[i];
      double* const to = sums(h.id);
      double const weight = h.transmittance * h.alpha;
      for (int c = 0; c < 3; ++c) {
        if (h.clamped >> c & 1) continue;
        for (std::size_t k = 0; k < active_; ++k) to[11 + 3 * k + c] += weight * g[c] * basis.y[k];
      }
      double const by_alpha = h.transmittance * dot(g, h.color - behind);
      if (h.raw < opaque) add_geometry(bodies_[h.id], h, d, h.raw * by_alpha, to);
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

  // alpha = sigma rho(|p|) with p = S^-1 R^T (t d - mean); t is where |p| is least, so moving it changes nothing. `a`
  // is alpha dL/dalpha. to: mean, log-scale, quaternion, opacity.
  void add_geometry(body const& g, reference_hit const& h, vec3d const& d, double a, double* to) const {
    double const b = a * kernel_.slope(dot(h.p, h.p));
    vec3d const by_body = -b * h.p * g.inverse_scale;  // dL by R^T (t d - mean)
    vec3d const by_point = g.rotate(by_body), x = h.t * d - g.mean;
    for (int k = 0; k < 3; ++k) to[k] -= by_point[k], to[3 + k] += b * h.p[k] * h.p[k];
    // x . R v with R v = v + 2 w u x v + 2 u x (u x v), by (w, u); then through the division by the norm.
    vec3d const &u = g.axis, &v = by_body;
    double by_w = 2 * dot(x, cross(u, v));
    vec3d by_u = 2 * g.w * cross(v, x) + 2.0 * (x * dot(u, v) + v * dot(u, x) - 2.0 * u * dot(x, v));
    double const along = by_w * g.w + dot(by_u, u);
    by_w -= along * g.w, by_u -= along * u;
    to[6] += by_w / g.norm;
    for (int k = 0; k < 3; ++k) to[7 + k] += by_u[k] / g.norm;
    to[10] += a * (1 - g.sigma);
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

// From the gradient by what the pixels see of a Gaussian to that by what is stored: each stored number moves the
// log-scales and the logit that are seen.
void pull_back(reference_gradients& g, std::size_t i, filter const& pixels, filter::parameters<double> const& stored) {
  using complex = std::complex<double>;
  constexpr double step = 1e-30;
  filter::parameters<complex> at;
  std::copy_n(stored.mean, 3, at.mean), std::copy_n(stored.log_scale, 3, at.log_scale);
  std::copy_n(stored.quaternion, 4, at.quaternion), at.opacity = stored.opacity;
  double const by_scale[3] = {g.log_scale[3 * i], g.log_scale[3 * i + 1], g.log_scale[3 * i + 2]},
               by_opacity = g.opacity[i];
  auto const moved = [&](complex& x) {
    x.imag(step);
    auto const out = pixels.seen(at);
    x.imag(0);
    double sum = by_opacity * out.opacity.imag();
    for (int k = 0; k < 3; ++k) sum += by_scale[k] * out.log_scale[k].imag();
    return sum / step;
  };
  for (int k = 0; k < 3; ++k) g.mean[3 * i + k] += moved(at.mean[k]);
  for (int k = 0; k < 3; ++k) g.log_scale[3 * i + k] = moved(at.log_scale[k]);
  for (int k = 0; k < 4; ++k) g.quaternion[4 * i + k] += moved(at.quaternion[k]);
  g.opacity[i] = moved(at.opacity);
}

// The places in `pixels`, block by block.
std::vector<std::vector<u32>> blocks_of(camera const& view, std::vector<u32> const& pixels) {
  u32 const width = static_cast<u32>(view.width), across = (width + block_side - 1) / block_side;
  u32 const down = (static_cast<u32>(view.height) + block_side - 1) / block_side;
  std::vector<std::vector<u32>> all(std::size_t{across} * down);
  for (std::size_t k = 0; k < pixels.size(); ++k)
    all[pixels[k] / width / block_side * across + pixels[k] % width / block_side].push_back(static_cast<u32>(k));
  std::erase_if(all, [](auto const& members) { return members.empty(); });
  return all;
}

void check(gaussian_model const& model, camera const& view, render_options const& options, int active_degree,
           std::vector<u32> const& pixels, std::vector<double> const& color_gradient, int kernel_degree) {
  if (active_degree < 0 || active_degree > model.sh_degree || model.sh_degree > 3)
    throw invalid_argument("reference: the active SH degree must lie between 0 and the model's, and that be at most 3");
  if (kernel_degree < 1) throw invalid_argument("reference: the kernel's degree must be at least 1");
  if (!(options.alpha_min > 0)) throw invalid_argument("reference: alpha_min must be positive");
  if (!color_gradient.empty() && color_gradient.size() != 3 * pixels.size())
    throw invalid_argument("reference: the colour's gradient must have three values a pixel");
  std::vector<bool> seen(static_cast<std::size_t>(view.width) * view.height);
  for (u32 const p : pixels) {
    if (p >= seen.size() || seen[p])
      throw invalid_argument("reference: pixel " + std::to_string(p) + " is outside the image, or named twice");
    seen[p] = true;
  }
}

}  // namespace

std::vector<u32> all_pixels(camera const& view) {
  std::vector<u32> all(static_cast<std::size_t>(view.width) * view.height);
  std::iota(all.begin(), all.end(), u32{0});
  return all;
}

reference_image trace_reference(gaussian_model const& model, camera const& view, render_options const& options,
                                int active_degree, std::vector<u32> const& pixels,
                                std::vector<double> const& color_gradient, int kernel_degree) {
  check(model, view, options, active_degree, pixels, color_gradient, kernel_degree);
  kernel const falloff{kernel_degree};
  std::size_t const n = model.size();
  bool const backwards = !color_gradient.empty();
  reference_image out;
  out.color.resize(3 * pixels.size()), out.transmittance.resize(pixels.size()), out.depth.resize(pixels.size());
  out.hits.resize(pixels.size());
  if (backwards)
    out.gradients = {model.sh_degree,
                     std::vector<double>(3 * n),
                     std::vector<double>(3 * n),
                     std::vector<double>(4 * n),
                     std::vector<double>(n),
                     std::vector<double>(model.sh.size())};

  std::vector<vec3d> rays(pixels.size());
  for (std::size_t k = 0; k < pixels.size(); ++k) rays[k] = ray_through(view, pixels[k]);
  std::vector<body> bodies(n);
  filter const view_filter(view, options.antialias);
#pragma omp parallel for
  for (std::size_t i = 0; i < n; ++i)
    bodies[i] = body_of(model, i, view.position, options.alpha_min, falloff, view_filter);

  pixel_tracer const tracer(model, options, active_degree, falloff, bodies);
  auto const blocks = blocks_of(view, pixels);
#pragma omp parallel for ordered schedule(dynamic, 1)
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    cone const around(rays, blocks[b], !(options.near >= 0));
    std::vector<u32> candidates;
    for (std::size_t i = 0; i < n; ++i)
      if (around.may_meet(bodies[i])) candidates.push_back(static_cast<u32>(i));
    block_sums sums(backwards ? candidates.size() : 0, tracer.stored());
    for (u32 const k : blocks[b]) {
      harmonics const basis(rays[k]);
      auto const list = tracer.hits(rays[k], basis, candidates);
      tracer.composite(list, k, out);
      if (!backwards) continue;
      vec3d const g(color_gradient[3 * k], color_gradient[3 * k + 1], color_gradient[3 * k + 2]);
      tracer.differentiate(list, rays[k], basis, g, [&](u32 id) {
        return sums.at(
            static_cast<std::size_t>(std::lower_bound(candidates.begin(), candidates.end(), id) - candidates.begin()));
      });
    }
    if (backwards) {
#pragma omp ordered
      sums.add_to(out.gradients, candidates);
    }
  }
  if (backwards && view_filter.any()) {
#pragma omp parallel for
    for (std::size_t i = 0; i < n; ++i)
      if (bodies[i].valid) pull_back(out.gradients, i, view_filter, stored_parameters(model, i, view.position));
  }
  return out;
}

}  // namespace gart
