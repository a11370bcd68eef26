#pragma once
/// \file
/// Densification by error: where the image is wrong, the Gaussians that are seen there split.
///
/// The statistic. The backward pass sums, over a Gaussian's hits, the weight w of the hit times the error of its pixel.
/// It works for any camera, since it needs no projection. The sums of all steps since the last densification are the
/// Gaussian's share of the total error. A mean over the views that saw it would favour haze that few views see. The
/// share is multiplied by the opacity. Haze shows much error that other Gaussians cause, and splitting haze overfits
/// single views.
///
/// A densification draws Gaussians without replacement, in proportion to opacity times the square root of the share.
/// Photographs that disagree leave an error that no split takes away, and the root gives it fewer splits. Where they
/// agree the share itself may be better (draw_by_root). The least values of -ln(u) / weight, u uniform, are drawn
/// (Efraimidis and Spirakis 2006). Each is split along its long axis (long_axis_split.hpp). One is drawn for each dead
/// Gaussian, whose row the second child takes. So is one for each that the count grows by. The count follows a
/// square-root curve to the budget at the share `growth_end` of the run. It at most doubles at a time. Few pixels in
/// the capture lower the budget (growth_budget). Gaussians of a pixel or two learn the noise and pose errors of
/// photographs. First children keep Adam's moments, second ones start with none. After `growth_end` only the dead are
/// replaced, after `until` nothing moves.
///
/// A small penalty on the mean opacity fades Gaussians that no view needs, until they are dead. A Gaussian whose
/// opacity or geometry is not finite counts as dead. Where no error is attributed, or none is alive, nothing is moved.
///
/// Its only state is the statistic, [N] floats, which checkpoints hold. Draws depend on it, the seed and the step.
/// Equal weights give the same draws on every policy, to the last bits of a logarithm. Cost: one small launch a step; a
/// densification is a sort of N pairs, two scans and one host read.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/core/error.hpp>
#include <gart/math/logit.hpp>
#include <gart/optim/long_axis_split.hpp>
#include <gart/optim/options.hpp>
#include <gart/optim/random.hpp>
#include <gart/train/densify/densifier.hpp>
#include <gart/train/foreground_fraction.hpp>
#include <gart/train/view_order.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct error_penalty_kernel {
  float const* opacity;
  float* gradient;
  float share;
  GART_KERNEL void operator()(index_t i) const {
    float const o = sigmoid(opacity[i]);
    gradient[i] += share * o * (1.0f - o);
  }
};

// Keys whose order is that of the draws; what cannot be drawn comes last.
struct error_key_kernel {
  gaussians_view<float const> model;
  row_owners owners;
  float const* sum;
  float dead_opacity;
  float const* filter;  // or null
  bool by_root;
  random_source random;
  u32* dead;
  u32* drawable;
  u32* key;
  u32* id;
  GART_KERNEL void operator()(index_t i) const {
    bool const lives = is_alive(model, i, dead_opacity, filter);
    float const weight = (by_root ? sqrtf(sum[i]) : sum[i]) * sigmoid(model.opacity[i]);
    bool const fits = lives && weight > 0 && is_finite(weight);
    float const u = (static_cast<float>(random.words(owners.global(i)).v[0] >> 8) + 0.5f) * 0x1p-24f;
    dead[i] = !lives, drawable[i] = fits;
    key[i] = fits ? float_to_bits(-logf(u) / weight) : 0xffffffffu;
    id[i] = static_cast<u32>(owners.global(i));
  }
};

// Row k becomes a child of its Gaussian.
struct error_split_kernel {
  gaussians_view<float> model;
  u32 const* rows;
  row_owners owners;
  split_shape shape;
  bool second;  // of the children
  float least_opacity;
  GART_KERNEL void operator()(index_t k) const {
    if (!owners.owns(rows[k])) return;
    std::size_t const row = owners.local(rows[k]);
    float const* const q = model.quaternion + 4 * row;
    float* const m = model.mean + 3 * row;
    float* const s = model.log_scale + 3 * row;
    vec3 const mean(m[0], m[1], m[2]);
    split_child const child =
        split_long_axis(shape, vec3(s[0], s[1], s[2]), {q[0], q[1], q[2], q[3]}, sigmoid(model.opacity[row]));
    float const opacity = child.opacity > least_opacity ? child.opacity : least_opacity;
    vec3 const center = second ? mean - child.offset : mean + child.offset;
    for (int c = 0; c < 3; ++c) m[c] = center[c], s[c] = child.log_scale[c];
    model.opacity[row] = logit(opacity);
  }
};

}  // namespace detail

/// The count that growth ends at, in a capture of so many training pixels: `most`, or what options.pixels_per_gaussian
/// leaves.
inline index_t growth_budget(error_growth_options const& options, index_t most, u64 pixels) {
  if (!(options.pixels_per_gaussian > 0)) return most;
  double const fit = static_cast<double>(pixels) / static_cast<double>(options.pixels_per_gaussian);
  double const limit = most, least = std::min(limit, static_cast<double>(std::max(options.min_gaussians, 0)));
  return static_cast<index_t>(std::clamp(fit, least, limit));
}

/// The q that children are made by, in a capture of so many training pixels: options.split.offset, or what suits it.
/// Nearer children overlap and fit their common part better. Where pixels limit growth, the overlap of large Gaussians
/// costs more memory than it gains.
inline float split_offset(error_growth_options const& options, index_t most, u64 pixels) {
  if (options.split.offset != 0) return options.split.offset;
  return growth_budget(options, most, pixels) < most ? 0.4f : 0.35f;
}

/// Steps count from 1.
template <execution E>
class error_growth final : public densifier<E> {
 public:
  /// The error seen through each Gaussian since the last densification, [N], for checkpoints.
  buffer<float, E> error_sum;

  /// For a run of so many steps, up to so many Gaussians (growth_budget), with the split's share given (split_offset).
  /// Errors: invalid_argument for a split that leaves no children.
  error_growth(E& exec, error_growth_options const& options, index_t max_gaussians, int iterations, u64 seed)
      : densifier<E>({options.from, options.every, options.until}, iterations),
        error_sum(exec),
        exec_(&exec),
        options_(options),
        max_gaussians_(max_gaussians),
        seed_(seed),
        dead_(exec),
        drawable_(exec),
        key_(exec),
        id_(exec),
        target_(exec),
        place_(exec),
        totals_(exec, 2) {
    split_shape const& split = options.split;
    if (!(split.offset > 0 && split.offset < 1))
      throw invalid_argument("split_shape.offset is " + std::to_string(split.offset) + ": more than 0, less than 1");
    if (!(split.opacity > 0 && split.opacity <= 1))
      throw invalid_argument("split_shape.opacity is " + std::to_string(split.opacity) + ": more than 0, at most 1");
  }
  /// For a run.
  error_growth(E& exec, density_setup const& run)
      : error_growth(exec, options_of(run.options, run.data),
                     growth_budget(run.options.error, run.options.max_gaussians, run.data.training_pixels()),
                     run.options.iterations, run.options.seed) {}

  bool by_error() const override { return true; }
  /// Of another count than before it is zero.
  span<float> error_sums(index_t n) override {
    if (error_sum.size() != n) error_sum.resize(n), error_sum.zero();
    return error_sum.view();
  }
  void penalty(trained_gaussians<E>& g, index_t total) override {
    if (g.size() && options_.opacity_penalty > 0)
      parallel_for(*exec_, "error_penalty", g.size(),
                   detail::error_penalty_kernel{g.model.opacity.data(), g.gradients.opacity.data(),
                                                options_.opacity_penalty / static_cast<float>(total)});
  }
  density_change step(trained_gaussians<E>& g, density_step<E> const& now) override {
    return this->due(now.step) ? densify(g, now) : density_change{};
  }
  void save(named_arrays& state) const override { state.set("error_growth/error_sum", error_sum.to_host()); }
  void load(named_arrays const& state) override { error_sum.assign(state.get<float>("error_growth/error_sum")); }

  /// The count that a run is to have after a step.
  index_t budget_at(int step) const {
    double const filled = static_cast<double>(options_.growth_end) * this->iterations_ - options_.from;
    double const share = filled > 0 ? std::clamp((step - options_.from) / filled, 0.0, 1.0) : 1.0;
    return static_cast<index_t>(std::sqrt(share) * max_gaussians_);
  }

  /// Splits those with the most error, and moves the dead.
  density_change densify(trained_gaussians<E>& g, density_step<E> const& now) {
    stage_scope stage(*exec_, "densify");
    density_change change;
    auto const [rows, here, n, owners] = rows_of(g, now);
    if (n == 0) return change;
    float const* const errors = error_sums(here).data();
    dead_.resize(here), drawable_.resize(here), key_.resize(here), id_.resize(here), place_.resize(n);
    parallel_for(*exec_, "error_keys", here,
                 detail::error_key_kernel{std::as_const(g.model).view(),
                                          owners,
                                          errors,
                                          options_.dead_opacity,
                                          now.filter.data(),
                                          options_.draw_by_root,
                                          {seed_, static_cast<u32>(now.step), random_use::growth},
                                          dead_.data(),
                                          drawable_.data(),
                                          key_.data(),
                                          id_.data()});
    for (buffer<u32, E>* each : {&dead_, &drawable_, &key_, &id_}) rows.gather(*exec_, *each);
    exclusive_scan(*exec_, span<u32 const>(drawable_), place_.view(), totals_.view().subspan(0, 1));
    exclusive_scan(*exec_, span<u32 const>(dead_), place_.view(), totals_.view().subspan(1, 1));
    u64 totals[2];
    exec_->copy_out(totals, totals_.data(), sizeof totals);
    index_t const drawable = static_cast<index_t>(totals[0]), dead = static_cast<index_t>(totals[1]);

    change.relocated = std::min(dead, drawable);
    index_t const goal = std::min(budget_at(now.step), max_gaussians_);
    change.added = std::min(goal > n ? goal - n : 0, drawable - change.relocated);
    if (change.any()) {
      sort_pairs(*exec_, key_.view(), id_.view(), 32);
      index_t const draws = change.relocated + change.added;
      target_.resize(std::max(dead, draws));
      if (dead)
        parallel_for(*exec_, "error_targets", n, detail::list_rows{dead_.data(), place_.data(), target_.data()});
      // Past the dead, the rows that are new.
      parallel_for(*exec_, "error_append", change.added, detail::number_rows{target_.data() + change.relocated, n});
      g.resize(rows.here(n + change.added));
      span<u32 const> const from(id_.data(), draws), to(target_.data(), draws);
      rows.copy(*exec_, g.model, from, to);
      clear_moments(*exec_, g.moments, to, owners);
      for (bool const second : {false, true})
        parallel_for(*exec_, "error_split", draws,
                     detail::error_split_kernel{g.model.view(), (second ? to : from).data(), owners, options_.split,
                                                second, 1.01f * options_.dead_opacity});
    }
    error_sum.resize(g.size()), error_sum.zero();
    return change;
  }

 private:
  static error_growth_options options_of(train_options const& options, dataset const& data) {
    error_growth_options e = options.error;
    if (e.opacity_penalty > 0)
      e.opacity_penalty *= penalty_scale(
          foreground_fraction(data, views_trained_on(data.train.size(), options.held_out), options.background));
    e.split.offset = split_offset(e, options.max_gaussians, data.training_pixels());
    e.dead_opacity = least_opacity(e.dead_opacity, options.render.alpha_min);
    return e;
  }

  E* exec_;
  error_growth_options options_;
  index_t max_gaussians_;
  u64 seed_;
  buffer<u32, E> dead_, drawable_, key_, id_, target_;
  buffer<u64, E> place_, totals_;
};

}}  // namespace gart::GART_ISA
