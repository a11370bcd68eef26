#pragma once
/// \file
/// Densification as Markov chain Monte Carlo. Source: Kheradmand et al., 3D Gaussian Splatting as Markov Chain Monte
/// Carlo, 2024; constants as in gsplat. Dead Gaussians move onto live ones, drawn in proportion to opacity; growth to
/// the budget draws in the same way. Every step moves the means at random, and penalizes opacity and size a little.
///
/// A Gaussian of opacity o may become N in one place: itself and its copies, N cut at 51. It keeps its image:
///   o' = 1 - (1 - o)^(1/N),  scale' = scale * o / sum_{j=1..N} C(N, j) (-1)^(j-1) o'^j / sqrt(j),
/// which keeps the integral of the composited opacity across a line through the centre. It is the paper's double sum,
/// with sum_i C(i-1, j-1) = C(N, j). For a generalised Gaussian of degree n (math/response.hpp) it is the n-th root of
/// j. Moments as in gsplat. Growth keeps the moments of sources, and copies start without. Relocation clears the
/// sources' moments and keeps those of moved Gaussians. A first moment fills up in 10 steps, a second one in 1,000. So
/// cleared ones step up to 6.5 times their rate for a hundred steps. If growth cleared its sources, the best Gaussians
/// would do so all the time (docs/training.md).
///
/// Noise and the size penalty are in units of the scene's extent, so a capture in other units trains alike.
///
/// Weights are 32-bit fixed point and their sums 64-bit integers. So draws are exact, with the same bits on every
/// policy. A Gaussian whose opacity or geometry is not finite counts as dead. Where none is alive nothing is relocated
/// or grown. Cost: one host read and O(N) work a densification; a step in between is two small launches.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/math/logit.hpp>
#include <gart/math/quaternion.hpp>
#include <gart/optim/options.hpp>
#include <gart/optim/random.hpp>
#include <gart/train/densify/densifier.hpp>

#include <algorithm>
#include <cmath>

namespace gart { inline namespace GART_ISA {

/// o', and scale' / scale.
struct relocated_shape {
  double opacity, scale_factor;  ///< as above
};

/// Of each of `copies` Gaussians that replace one of opacity `o`. In double: the sum alternates.
GART_HD inline relocated_shape relocation(double o, u32 copies, int kernel_degree = 2) {
  double const n = copies < 51 ? copies : 51;
  double const p = -expm1(log1p(-o) / n);
  double term = 1, sum = 0;
  for (int j = 1; j <= static_cast<int>(n); ++j) {
    term *= (n - j + 1) / j * p * (j > 1 ? -1 : 1);
    sum +=
        term / (kernel_degree == 2 ? sqrt(static_cast<double>(j)) : pow(static_cast<double>(j), 1.0 / kernel_degree));
  }
  return {p, o / sum};
}

namespace detail {

struct mcmc_weight_kernel {
  gaussians_view<float const> model;
  float dead_opacity;
  float const* filter;  // or null
  u32* weight;          // 0 for the dead
  u32* dead;

  GART_KERNEL void operator()(index_t i) const {
    float const o = sigmoid(model.opacity[i]);
    bool const alive = is_alive(model, i, dead_opacity, filter);
    dead[i] = !alive;
    u32 const fixed = static_cast<u32>(static_cast<double>(o < 1 ? o : 1.0f) * 4294967295.0 * alive);
    weight[i] = alive && fixed == 0 ? 1u : fixed;
  }
};

template <execution E>
struct mcmc_draw_kernel {
  u64 const* before;  // exclusive sums of the weights
  u64 const* total;
  index_t count;
  random_source random;
  u32* source;
  u32* copies;

  GART_KERNEL void operator()(index_t draw) const {
    random_words const w = random.words(draw);
    u64 const at = below(w.v[0], w.v[1], *total);
    // The last Gaussian whose sum is at most `at`: its weight is not zero.
    index_t low = 0, high = count;
    while (high - low > 1) {
      index_t const middle = low + (high - low) / 2;
      (before[middle] <= at ? low : high) = middle;
    }
    source[draw] = low;
    E::atomic_add(copies + low, 1u);
  }
};

struct mcmc_share_kernel {
  gaussians_view<float> model;
  u32 const* copies;  // by number
  row_owners owners;
  float least_opacity;
  int kernel_degree;

  GART_KERNEL void operator()(index_t i) const {
    u32 const copied = copies[owners.global(i)];
    if (copied == 0) return;
    double const o = fmin(sigmoid_in_double(static_cast<double>(model.opacity[i])), 1 - 1e-7);
    relocated_shape const shape = relocation(o, copied + 1, kernel_degree);
    double const opacity = fmin(fmax(shape.opacity, static_cast<double>(least_opacity)), 1 - 1e-7);
    model.opacity[i] = static_cast<float>(logit_in_double(opacity));
    float const shift = static_cast<float>(log(shape.scale_factor));
    for (int c = 0; c < 3; ++c) model.log_scale[i * std::size_t{3} + c] += shift;
  }
};

struct mcmc_noise_kernel {
  gaussians_view<float> model;
  random_source random;
  row_owners owners;
  float amount, dead_opacity;

  GART_KERNEL void operator()(index_t i) const {
    float const o = sigmoid(model.opacity[i]);
    float const gate = amount * sigmoid(-100.0f * (o - dead_opacity));
    float const* const q = model.quaternion + std::size_t{4} * i;
    quaternion const turn{q[0], q[1], q[2], q[3]};
    if (!(gate > 0) || !(norm2(turn) > quaternion_norm2_min)) return;
    mat3 const rotation = to_matrix(turn);
    random_normals const n = normals(random.words(owners.global(i)));
    vec3 moved(0.0f);  // the covariance times n, axis by axis
    for (int c = 0; c < 3; ++c) {
      vec3 const axis = rotation[c];
      float const along = axis.x * n.v[0] + axis.y * n.v[1] + axis.z * n.v[2];
      moved += axis * (along * expf(2 * model.log_scale[std::size_t{3} * i + c]));
    }
    float* const mean = model.mean + std::size_t{3} * i;
    moved = vec3(mean[0], mean[1], mean[2]) + gate * moved;
    if (!is_finite(moved.x) || !is_finite(moved.y) || !is_finite(moved.z)) return;
    mean[0] = moved.x, mean[1] = moved.y, mean[2] = moved.z;
  }
};

struct mcmc_penalty_kernel {
  gaussians_view<float const> model;
  gaussians_view<float> gradient;
  float opacity_share, scale_share;

  GART_KERNEL void operator()(index_t i) const {
    float const o = sigmoid(model.opacity[i]);
    gradient.opacity[i] += opacity_share * o * (1.0f - o);
    for (std::size_t c = 3 * std::size_t{i}; c < 3 * std::size_t{i} + 3; ++c)
      gradient.log_scale[c] += scale_share * expf(model.log_scale[c]);
  }
};

}  // namespace detail

/// The growth factor of a run that starts from `count` Gaussians. It is options.growth, or a larger factor, at most
/// 1.2. That one reaches the budget in the first two fifths of the densifications.
inline float growth_for(mcmc_options const& options, index_t count, index_t max_gaussians, int iterations) {
  constexpr double steepest = 1.2;
  float const steps = options.until * static_cast<float>(iterations) - static_cast<float>(options.from);
  double const rounds = 0.4 * static_cast<double>(steps) / (options.every > 0 ? options.every : 1);
  if (count == 0 || count >= max_gaussians || rounds < 1) return options.growth;
  double const needed = std::pow(static_cast<double>(max_gaussians) / count, 1 / rounds);
  double const given = static_cast<double>(options.growth), limit = given > steepest ? given : steepest;
  return static_cast<float>(needed < given ? given : needed > limit ? limit : needed);
}

/// Its draws depend on the seed and the step only. Steps count from 1.
template <execution E>
class mcmc final : public densifier<E> {
 public:
  /// `extent` is the scene's, in world units.
  mcmc(E& exec, mcmc_options const& options, index_t max_gaussians, int iterations, float extent, u64 seed,
       int kernel_degree = 2)
      : densifier<E>({options.from, options.every, options.until}, iterations),
        exec_(&exec),
        options_(options),
        growth_(options.growth),
        kernel_degree_(kernel_degree),
        max_gaussians_(max_gaussians),
        extent_(extent),
        seed_(seed),
        weight_(exec),
        dead_(exec),
        target_(exec),
        source_(exec),
        before_(exec),
        dead_before_(exec),
        totals_(exec, 2) {}
  /// For a run.
  mcmc(E& exec, density_setup const& run)
      : mcmc(exec, options_of(run.options), run.options.max_gaussians, run.options.iterations, run.data.extent,
             run.options.seed, run.kernel_degree) {
    started_with_ = run.start;
    set_iterations(run.options.iterations);
  }

  void set_iterations(int iterations) override {
    densifier<E>::set_iterations(iterations);
    growth_ = growth_for(options_, started_with_, max_gaussians_, iterations);
  }
  /// The gradient of opacity_penalty * mean(opacity) + scale_penalty * mean(scale) / extent.
  void penalty(trained_gaussians<E>& g, index_t total) override {
    if (g.size() == 0) return;
    float const n = static_cast<float>(total);
    parallel_for(*exec_, "mcmc_penalties", g.size(),
                 detail::mcmc_penalty_kernel{g.model.view(), g.gradients.view(), options_.opacity_penalty / n,
                                             options_.scale_penalty / (3 * n * extent_)});
  }
  /// Relocation and growth where they are due, and the noise.
  density_change step(trained_gaussians<E>& g, density_step<E> const& now) override {
    density_change change;
    if (this->due(now.step)) change = densify(g, now);
    add_noise(g.model, now.step, now.mean_rate, now.rows.owners());
    return change;
  }
  void save(named_arrays& state) const override { state.set("growth", std::vector<float>{growth_}); }
  void load(named_arrays const& state) override {
    if (auto const growth = state.get<float>("growth"); growth.size() == 1) growth_ = growth[0];
  }

  /// Relocates and grows.
  density_change densify(trained_gaussians<E>& g, density_step<E> const& now) {
    stage_scope stage(*exec_, "densify");
    density_change change;
    all_rows<E>& rows = now.rows;
    index_t const n = rows.total(g.size());
    u32 const step = static_cast<u32>(now.step);
    if (n == 0) return change;
    weigh(g.model, options_.dead_opacity, now.filter.data(), rows);
    u64 totals[2];
    exec_->copy_out(totals, totals_.data(), sizeof totals);
    if (totals[0] == 0) return change;

    change.relocated = static_cast<index_t>(totals[1]);
    if (change.relocated) {
      target_.resize(change.relocated);
      parallel_for(*exec_, "mcmc_list", n, detail::list_rows{dead_.data(), dead_before_.data(), target_.data()});
      draw(g, n, change.relocated, {seed_, step, random_use::relocation}, rows);
    }

    double const wanted = std::ceil(static_cast<double>(growth_) * n);
    index_t const goal = wanted < max_gaussians_ ? static_cast<index_t>(wanted) : max_gaussians_;
    if (goal > n) {
      change.added = goal - n;
      // Relocation may have left Gaussians at the opacity that counts as dead; all but broken ones may be drawn here.
      weigh(g.model, 0, nullptr, rows);
      g.resize(rows.here(goal));
      target_.resize(change.added);
      parallel_for(*exec_, "mcmc_append", change.added, detail::number_rows{target_.data(), n});
      draw(g, n, change.added, {seed_, step, random_use::growth}, rows);
    }
    return change;
  }

  /// mean += noise * mean_rate / extent^2 * sigmoid(-100 (opacity - dead_opacity)) * covariance * normal.
  void add_noise(gaussians<E>& model, int step, float mean_rate, row_owners const& owners = {}) {
    if (options_.noise == 0) return;
    parallel_for(*exec_, "mcmc_noise", model.size(),
                 detail::mcmc_noise_kernel{model.view(),
                                           {seed_, static_cast<u32>(step), random_use::noise},
                                           owners,
                                           options_.noise * mean_rate / (extent_ * extent_),
                                           options_.dead_opacity});
  }

 private:
  static mcmc_options options_of(train_options const& options) {
    mcmc_options m = options.mcmc;
    m.dead_opacity = least_opacity(m.dead_opacity, options.render.alpha_min);
    return m;
  }

  void weigh(gaussians<E> const& model, float dead_opacity, float const* filter, all_rows<E>& rows) {
    index_t const here = model.size(), n = rows.total(here);
    weight_.resize(here), dead_.resize(here), before_.resize(n), dead_before_.resize(n);
    parallel_for(*exec_, "mcmc_weights", here,
                 detail::mcmc_weight_kernel{model.view(), dead_opacity, filter, weight_.data(), dead_.data()});
    rows.gather(*exec_, weight_), rows.gather(*exec_, dead_);
    exclusive_scan(*exec_, span<u32 const>(weight_), before_.view(), totals_.view().subspan(0, 1));
    exclusive_scan(*exec_, span<u32 const>(dead_), dead_before_.view(), totals_.view().subspan(1, 1));
  }

  // `draws` copies of Gaussians among the first n, by weight, into the rows of target_.
  void draw(trained_gaussians<E>& g, index_t n, index_t draws, random_source const& random, all_rows<E>& rows) {
    buffer<u32, E>& copies = dead_;
    source_.resize(draws);
    copies.zero();
    parallel_for(*exec_, "mcmc_draw", draws,
                 detail::mcmc_draw_kernel<E>{before_.data(), totals_.data(), n, random, source_.data(), copies.data()});
    parallel_for(
        *exec_, "mcmc_share", std::min(g.size(), rows.here(n)),
        detail::mcmc_share_kernel{g.model.view(), copies.data(), rows.owners(), options_.dead_opacity, kernel_degree_});
    rows.copy(*exec_, g.model, source_, target_);
    clear_moments(*exec_, g.moments, random.use == random_use::growth ? target_ : source_, rows.owners());
  }

  E* exec_;
  mcmc_options options_;
  float growth_;  // of each densification
  index_t started_with_ = 0;
  int kernel_degree_;  // of the Gaussians that are relocated
  index_t max_gaussians_;
  float extent_;
  u64 seed_;
  buffer<u32, E> weight_, dead_, target_, source_;
  buffer<u64, E> before_, dead_before_, totals_;
};

}}  // namespace gart::GART_ISA
