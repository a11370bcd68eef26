#include "pixel_tracer.hpp"

#include <gart/core/error.hpp>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>
#include <string>

namespace gart {

using namespace by_definition;

namespace {

// The filter of a view's pixels, also of complex numbers. The imaginary part after an imaginary step gives a derivative
// exact to double, without a difference.
class filter {
 public:
  filter(camera const& view, double pixels) : view_(view), pixels_(pixels) {
    if (!any()) return;
    constexpr int steps = 64;
    for (int k = 0; k <= steps; ++k) {
      double const u = view.width * (k / double{steps}), v = view.height * (k / double{steps});
      for (auto const& [at_u, at_v] : {std::pair{u, 0.0}, {u, 1.0 * view.height}, {0.0, v}, {1.0 * view.width, v}}) {
        lens_point const p =
            unbent(view.lens, false, (at_u - view.cx) / double{view.fx}, (at_v - view.cy) / double{view.fy});
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
  // |x - mean| <= |p| times the largest scale.
  double const radius = 1.000001 * largest * k.reach(g.sigma / alpha_min), distance = length(g.mean);
  g.radius = radius, g.distance = distance;
  g.around_camera = !(radius < distance);
  g.valid = true;
  if (g.around_camera) return g;
  g.direction = g.mean / distance;
  g.sine = radius / distance, g.cosine = std::sqrt((1 - g.sine) * (1 + g.sine));
  return g;
}

// Turns the gradient by a Gaussian's filtered numbers into that by its stored ones. Each stored number moves the
// filtered log-scales and logit.
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
           std::vector<u32> const& pixels, std::vector<double> const& color_gradient, int kernel_degree,
           std::vector<double> const& depth_gradient) {
  if (active_degree < 0 || active_degree > model.sh_degree || model.sh_degree > 3)
    throw invalid_argument("reference: the active SH degree must lie between 0 and the model's, and that be at most 3");
  if (options.antialias > 0 &&
      (view.kind != camera_kind::perspective || view.lens.more() || view.shutter != shutter_kind::global))
    throw unsupported(
        "reference: it has the filter of pixels (options.antialias) of pinholes and of OpenCV's lenses (k1, k2, p1, "
        "p2) alone, that stand still");
  if (kernel_degree < 1) throw invalid_argument("reference: the kernel's degree must be at least 1");
  if (!(options.alpha_min > 0)) throw invalid_argument("reference: alpha_min must be positive");
  if (!color_gradient.empty() && color_gradient.size() != 3 * pixels.size())
    throw invalid_argument("reference: the colour's gradient must have three values a pixel");
  if (!depth_gradient.empty() && (depth_gradient.size() != pixels.size() || color_gradient.empty()))
    throw invalid_argument("reference: the depth's gradient must have a value a pixel, beside the colour's");
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
                                std::vector<double> const& color_gradient, int kernel_degree,
                                std::vector<double> const& depth_gradient) {
  check(model, view, options, active_degree, pixels, color_gradient, kernel_degree, depth_gradient);
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

  std::vector<pixel_ray> rays(pixels.size());
  for (std::size_t k = 0; k < pixels.size(); ++k) rays[k] = ray_of(view, pixels[k]);
  std::vector<body> bodies(n);
  filter const view_filter(view, options.antialias);
#if defined(_OPENMP)
#pragma omp parallel for
#endif
  for (std::size_t i = 0; i < n; ++i)
    bodies[i] = body_of(model, i, view.position, options.alpha_min, falloff, view_filter);

  pixel_tracer const tracer(model, options, active_degree, falloff, bodies);
  auto const blocks = blocks_of(view, pixels);
#if defined(_OPENMP)
#pragma omp parallel for ordered schedule(dynamic, 1)
#endif
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    cone const around(rays, blocks[b], !(options.near >= 0));
    std::vector<u32> candidates;
    for (std::size_t i = 0; i < n; ++i)
      if (around.may_meet(bodies[i])) candidates.push_back(static_cast<u32>(i));
    block_sums sums(backwards ? candidates.size() : 0, tracer.stored());
    for (u32 const k : blocks[b]) {
      harmonics const basis(rays[k].direction);
      auto const list = tracer.hits(rays[k], basis, candidates);
      tracer.composite(list, k, out);
      if (!backwards) continue;
      vec3d const g(color_gradient[3 * k], color_gradient[3 * k + 1], color_gradient[3 * k + 2]);
      double const by_depth = depth_gradient.empty() ? 0.0 : depth_gradient[k];
      tracer.differentiate(list, rays[k], basis, g, by_depth, [&](u32 id) {
        return sums.at(
            static_cast<std::size_t>(std::lower_bound(candidates.begin(), candidates.end(), id) - candidates.begin()));
      });
    }
    if (backwards) {
#if defined(_OPENMP)
#pragma omp ordered
#endif
      sums.add_to(out.gradients, candidates);
    }
  }
  if (backwards && view_filter.any()) {
#if defined(_OPENMP)
#pragma omp parallel for
#endif
    for (std::size_t i = 0; i < n; ++i)
      if (bodies[i].valid) pull_back(out.gradients, i, view_filter, stored_parameters(model, i, view.position));
  }
  return out;
}

}  // namespace gart
