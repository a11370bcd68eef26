#pragma once
// Adam (Kingma and Ba, 2015) over every parameter of every Gaussian in one launch, with a rate per group; the colour's
// constant term has a rate of its own. With g the gradient and t the step, counted from 1,
//   m = b1 m + (1 - b1) g,  v = b2 v + (1 - b2) g^2,  p -= rate * m / (1 - b1^t) / (sqrt(v / (1 - b2^t)) + epsilon).
// An element whose gradient (or update) is not finite keeps its value and moments, and is counted. Bound by memory:
// 28 bytes moved an element.

#include <gart/exec/concepts.hpp>
#include <gart/math/arith.hpp>
#include <gart/optim/options.hpp>
#include <gart/scene/gaussians.hpp>

#include <cmath>

namespace gart {

// Adam's moments, of the parameters' shape.
template <execution E>
struct optimizer_state {
  gaussians<E> first, second;

  optimizer_state() = default;
  optimizer_state(E& exec, index_t n, int sh_degree) : first(exec, n, sh_degree), second(exec, n, sh_degree) {
    first.zero(), second.zero();
  }
};

struct adam_options {
  float beta1 = 0.9f, beta2 = 0.999f, epsilon = 1e-15f;
};

namespace detail {

struct adam_group {
  float* parameter;
  float const* gradient;
  float* first;
  float* second;
  index_t stride;  // floats a Gaussian
  index_t active;  // of these, the first so many are trained
  index_t head;    // of these, the first so many have rate_head
  float rate_head, rate_rest;
};

// Group g has tiles [g * group_tiles, (g + 1) * group_tiles), each of `rows_per_tile` Gaussians.
template <execution E>
struct adam_kernel {
  static constexpr index_t rows_per_tile = 128;
  struct scratch {};
  adam_group groups[5];
  index_t group_tiles, rows;
  float beta1, beta2, epsilon, second_correction;  // 1 / sqrt(1 - b2^t); the rates carry 1 / (1 - b1^t)
  u64* skipped;

  template <class Team>
  GART_HD void operator()(Team const& team) const {
    index_t const group_index = team.tile() / group_tiles;
    index_t const row = (team.tile() - group_index * group_tiles) * rows_per_tile;
    index_t const count = rows - row < rows_per_tile ? rows - row : rows_per_tile;
    adam_group const& group = groups[group_index];
    std::size_t const base = std::size_t{row} * group.stride;
    team.for_each(count * group.stride, [&](index_t e) {
      index_t const column = e % group.stride;
      if (column < group.active) update(group, base + e, column < group.head ? group.rate_head : group.rate_rest);
    });
  }

  GART_HD void update(adam_group const& group, std::size_t i, float rate) const {
    float const g = group.gradient[i];
    float const m = fma(beta1, group.first[i], mul(1.0f - beta1, g));
    float const v = fma(beta2, group.second[i], mul(mul(1.0f - beta2, g), g));
    float const p = group.parameter[i] - rate * m / (square_root(v) * second_correction + epsilon);
    if (!is_finite(g) || !is_finite(v) || !is_finite(p)) {
      if (skipped) E::atomic_add(skipped, u64{1});
      return;
    }
    group.parameter[i] = p, group.first[i] = m, group.second[i] = v;
  }
};

}  // namespace detail

// Step `step` (from 1). Coefficients above `active_sh_degree` are left alone. `skipped`, one element or empty, counts
// up by the elements that were not finite.
template <execution E>
void adam_step(E& exec, gaussians<E>& model, gaussians<E> const& gradient, optimizer_state<E>& state,
               learning_rates const& rates, int step, int active_sh_degree, span<u64> skipped = {},
               adam_options const& options = {}) {
  if (model.size() == 0) return;
  using kernel = detail::adam_kernel<E>;
  double const correction = 1.0 / (1.0 - std::pow(static_cast<double>(options.beta1), step));
  auto const rate = [&](float r) { return static_cast<float>(r * correction); };
  auto const p = model.view();
  auto const g = gradient.view();
  auto const m = state.first.view(), v = state.second.view();
  index_t const sh = p.sh_stride();
  int const degree = active_sh_degree < p.sh_degree ? active_sh_degree : p.sh_degree;
  index_t const active_sh = 3 * sh_coefficients(degree);

  kernel k{};
  k.groups[0] = {p.sh, g.sh, m.sh, v.sh, sh, active_sh, 3, rate(rates.sh_dc), rate(rates.sh_rest)};
  k.groups[1] = {p.mean, g.mean, m.mean, v.mean, 3, 3, 3, rate(rates.mean), 0};
  k.groups[2] = {p.log_scale, g.log_scale, m.log_scale, v.log_scale, 3, 3, 3, rate(rates.log_scale), 0};
  k.groups[3] = {p.quaternion, g.quaternion, m.quaternion, v.quaternion, 4, 4, 4, rate(rates.quaternion), 0};
  k.groups[4] = {p.opacity, g.opacity, m.opacity, v.opacity, 1, 1, 1, rate(rates.opacity), 0};
  k.rows = p.count;
  k.group_tiles = p.count / kernel::rows_per_tile + (p.count % kernel::rows_per_tile != 0);
  k.beta1 = options.beta1, k.beta2 = options.beta2, k.epsilon = options.epsilon;
  k.second_correction = static_cast<float>(1.0 / std::sqrt(1.0 - std::pow(static_cast<double>(options.beta2), step)));
  k.skipped = skipped.data();
  parallel_for(exec, "adam", tile_range{5 * k.group_tiles, 256}, k);
}

}  // namespace gart
