#pragma once
// Any rays through all Gaussians in double, one by one: what a loss of them is, and by which hits, so that a difference
// which crosses a step is seen. It shares no code with the library.

#include <gart/rays/ray_batch.hpp>
#include <gart/render/options.hpp>
#include <gart/scene/gaussians.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

namespace gart_test {

// The arrays of a model, in double.
struct double_model {
  std::size_t count = 0, bands = 0, width = 0;
  std::vector<double> mean, log_scale, quaternion, opacity, sh, features;
  std::vector<double>
      turns;  // [count][3][3]: from directions of rays to those that harmonics take; empty: they are one

  explicit double_model(gart::gaussian_model const& m)
      : count(m.size()),
        bands(static_cast<std::size_t>((m.sh_degree + 1) * (m.sh_degree + 1))),
        mean(m.mean.begin(), m.mean.end()),
        log_scale(m.log_scale.begin(), m.log_scale.end()),
        quaternion(m.quaternion.begin(), m.quaternion.end()),
        opacity(m.opacity.begin(), m.opacity.end()),
        sh(m.sh.begin(), m.sh.end()),
        features(m.features.begin(), m.features.end()) {
    width = static_cast<std::size_t>(m.feature_count);
  }
};

struct double_ray {
  double origin[3], direction[3];  // of any length
  double end = HUGE_VAL;
};

// Weights of what a ray sees.
struct ray_weights {
  double color[3], depth, transmittance;
  float const* features = nullptr;  // of as many as the model has
};

struct seen {
  double loss = 0;
  std::uint64_t branches = 0;                           // which hits, in which order, clamped where
  std::vector<std::pair<std::size_t, double>> weights;  // of the hits, by Gaussian
};

inline void harmonics(double const (&d)[3], double (&y)[16]) {
  double const a = d[0], b = d[1], c = d[2];
  double const values[16] = {0.28209479177387814,
                             -0.4886025119029199 * b,
                             0.4886025119029199 * c,
                             -0.4886025119029199 * a,
                             1.0925484305920792 * a * b,
                             -1.0925484305920792 * b * c,
                             0.31539156525252005 * (2 * c * c - a * a - b * b),
                             -1.0925484305920792 * a * c,
                             0.5462742152960396 * (a * a - b * b),
                             -0.5900435899266435 * b * (3 * a * a - b * b),
                             2.890611442640554 * a * b * c,
                             -0.4570457994644658 * b * (4 * c * c - a * a - b * b),
                             0.3731763325901154 * c * (2 * c * c - 3 * a * a - 3 * b * b),
                             -0.4570457994644658 * a * (4 * c * c - a * a - b * b),
                             1.445305721320277 * c * (a * a - b * b),
                             -0.5900435899266435 * a * (a * a - 3 * b * b)};
  std::copy(values, values + 16, y);
}

inline seen see(double_model const& m, double_ray const& ray, ray_weights const& by, gart::render_options const& o) {
  double d[3], length = 0;
  for (double const x : ray.direction) length += x * x;
  length = std::sqrt(length);
  for (int k = 0; k < 3; ++k) d[k] = ray.direction[k] / length;
  struct hit {
    double t, alpha;
    std::size_t id;
    bool clamped;
    bool operator<(hit const& other) const { return t < other.t; }
  };
  std::vector<hit> hits;
  for (std::size_t i = 0; i < m.count; ++i) {
    double q[4], norm = 0;
    for (std::size_t k = 0; k < 4; ++k) q[k] = m.quaternion[4 * i + k], norm += q[k] * q[k];
    for (double& x : q) x /= std::sqrt(norm);
    double const w = q[0], x = q[1], y = q[2], z = q[3];
    double const r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)},
                            {2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)},
                            {2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)}};
    double og[3] = {}, dg[3] = {}, od = 0, dd = 0, p2 = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      double const inverse = std::exp(-m.log_scale[3 * i + k]);
      for (std::size_t j = 0; j < 3; ++j) {
        og[k] += r[j][k] * (ray.origin[j] - m.mean[3 * i + j]) * inverse;
        dg[k] += r[j][k] * d[j] * inverse;
      }
      od += og[k] * dg[k], dd += dg[k] * dg[k];
    }
    double const t = -od / dd;
    for (int k = 0; k < 3; ++k) p2 += (og[k] + t * dg[k]) * (og[k] + t * dg[k]);
    double const raw = std::exp(-0.5 * p2) / (1 + std::exp(-m.opacity[i]));
    if (raw >= double{o.alpha_min} && t > double{o.near} && t <= ray.end)
      hits.push_back({t, std::min(raw, 0.99), i, raw > 0.99});
  }
  std::sort(hits.begin(), hits.end());
  double basis[16];
  harmonics(d, basis);
  auto const turn = [&](std::size_t id) {
    double own[3] = {};
    for (std::size_t k = 0; k < 9; ++k) own[k / 3] += m.turns[9 * id + k] * d[k % 3];
    harmonics(own, basis);
  };
  seen out;
  double transmittance = 1;
  gart::u32 count = 0;
  auto const note = [&](std::uint64_t what) { out.branches = (out.branches ^ what) * 0x9e3779b97f4a7c15u; };
  for (hit const& h : hits) {
    double const weight = transmittance * h.alpha;
    std::uint64_t clamps = h.clamped;
    if (!m.turns.empty()) turn(h.id);
    for (std::size_t c = 0; c < 3; ++c) {
      double color = 0.5;
      for (std::size_t k = 0; k < m.bands; ++k) color += basis[k] * m.sh[3 * (m.bands * h.id + k) + c];
      if (color <= 0) clamps |= 2u << c;
      out.loss += by.color[c] * weight * std::max(color, 0.0);
    }
    out.loss += by.depth * weight * h.t;
    if (by.features)
      for (std::size_t c = 0; c < m.width; ++c)
        out.loss += double{by.features[c]} * weight * m.features[m.width * h.id + c];
    out.weights.emplace_back(h.id, weight);
    transmittance *= 1 - h.alpha;
    note(h.id << 8 | clamps);
    if (transmittance < double{o.transmittance_min} || ++count == o.max_hits) break;
  }
  for (int c = 0; c < 3; ++c) out.loss += by.color[c] * transmittance * double{o.background[c]};
  out.loss += by.transmittance * transmittance;
  return out;
}

}  // namespace gart_test
