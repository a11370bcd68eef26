#pragma once
/// \file
/// Densification by error: where the image is wrong, the Gaussians that are seen there split.
///
/// The statistic. The backward pass sums, over a Gaussian's hits, the weight w of the hit times the error of its pixel.
/// It works for any camera, since it needs no projection. The sums of all steps since the last densification are the
/// Gaussian's share of the total error. A mean over the views that saw it would favour haze that few views see. The
/// share is multiplied by the opacity: much error is seen through haze that other Gaussians cause, and splitting haze
/// overfits single views.
///
/// A densification draws Gaussians without replacement, in proportion to their share times their opacity (Efraimidis
/// and Spirakis 2006: the least of -ln(u) / weight, u uniform), and splits each along its long axis
/// (long_axis_split.hpp). As many are drawn as there are dead Gaussians, whose rows the second halves take, and as the
/// count is to grow. It grows on a square-root curve, early, to the budget at the share `fill` of the run, and at most
/// doubles at a time. The budget follows the capture's pixels where they are few (growth_budget): a Gaussian that
/// covers a pixel or two of each photograph learns its noise, and what is wrong with its pose. First halves keep Adam's
/// moments, second ones start with none. After `fill` only the dead are replaced, after `until` nothing moves.
///
/// A small penalty on the mean opacity, paid by all Gaussians, takes those that no view needs; they fade until they are
/// dead. A Gaussian whose opacity or geometry is not finite counts as dead. Where no error is attributed, or none is
/// alive, nothing is moved.
///
/// It has no state but the statistic, [N] floats, which a checkpoint must hold: what is drawn depends on it, the seed
/// and the step. Equal weights give the same draws on every policy but for the last bits of a logarithm. Cost: one
/// small launch a step; a densification is a sort of N pairs, two scans and one host read.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/core/error.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/math/logit.hpp>
#include <gart/optim/adam.hpp>
#include <gart/optim/long_axis_split.hpp>
#include <gart/optim/options.hpp>
#include <gart/optim/random.hpp>
#include <gart/optim/rows.hpp>
#include <gart/optim/schedule.hpp>

#include <algorithm>
#include <cmath>
#include <string>

namespace gart::inline GART_ISA {

namespace detail {

struct error_sum_kernel {
  float const* moments;
  float* sum;
  GART_KERNEL void operator()(index_t i) const { sum[i] += moments[std::size_t{moment_stride} * i + error_place]; }
};

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
  random_source random;
  u32* dead;
  u32* drawable;
  u32* key;
  u32* id;
  GART_KERNEL void operator()(index_t i) const {
    bool const lives = is_alive(model, i, dead_opacity, filter);
    float const weight = sum[i] * sigmoid(model.opacity[i]);
    bool const fits = lives && weight > 0 && is_finite(weight);
    float const u = (static_cast<float>(random.words(owners.global(i)).v[0] >> 8) + 0.5f) * 0x1p-24f;
    dead[i] = !lives, drawable[i] = fits;
    key[i] = fits ? float_to_bits(-logf(u) / weight) : 0xffffffffu;
    id[i] = static_cast<u32>(owners.global(i));
  }
};

struct error_target_kernel {
  u32 const* dead;
  u64 const* place;
  u32* target;
  GART_KERNEL void operator()(index_t i) const {
    if (dead[i]) target[place[i]] = i;
  }
};

// Row k becomes a half of what it is.
struct error_split_kernel {
  gaussians_view<float> model;
  u32 const* rows;
  row_owners owners;
  split_shape shape;
  bool second;  // of the halves
  float least_opacity;
  GART_KERNEL void operator()(index_t k) const {
    if (!owners.owns(rows[k])) return;
    std::size_t const row = owners.local(rows[k]);
    float const* const q = model.quaternion + 4 * row;
    float* const m = model.mean + 3 * row;
    float* const s = model.log_scale + 3 * row;
    vec3 const mean(m[0], m[1], m[2]);
    split_half const half =
        split_long_axis(shape, vec3(s[0], s[1], s[2]), {q[0], q[1], q[2], q[3]}, sigmoid(model.opacity[row]));
    float const opacity = half.opacity > least_opacity ? half.opacity : least_opacity;
    vec3 const center = second ? mean - half.offset : mean + half.offset;
    for (int c = 0; c < 3; ++c) m[c] = center[c], s[c] = half.log_scale[c];
    model.opacity[row] = logit(opacity);
  }
};

}  // namespace detail

/// The count that growth ends at, in a capture of so many training pixels: `most`, or what options.pixels_each leaves.
inline index_t growth_budget(error_growth_options const& options, index_t most, u64 pixels) {
  if (!(options.pixels_each > 0)) return most;
  double const fit = static_cast<double>(pixels) / static_cast<double>(options.pixels_each);
  double const limit = most, least = std::min(limit, static_cast<double>(std::max(options.least_budget, 0)));
  return static_cast<index_t>(std::clamp(fit, least, limit));
}

/// The q that halves are made by, in a capture of so many training pixels: options.split.share, or what suits it.
/// Nearer halves overlap, and fit better what they share; where pixels end growth the overlap of large Gaussians takes
/// more memory than it is worth.
inline float split_share(error_growth_options const& options, index_t most, u64 pixels) {
  if (options.split.share != 0) return options.split.share;
  return growth_budget(options, most, pixels) < most ? 0.4f : 0.35f;
}

/// Steps count from 1.
template <execution E>
class error_growth {
 public:
  /// The error seen through each Gaussian since the last densification, [N]: what a checkpoint must hold.
  buffer<float, E> error_sum;

  /// For a run of so many steps, up to so many Gaussians (growth_budget), with the split's share given (split_share).
  /// Errors: invalid_argument for a split that leaves no halves.
  error_growth(E& exec, error_growth_options const& options, index_t max_gaussians, int iterations, u64 seed)
      : error_sum(exec),
        exec_(&exec),
        options_(options),
        max_gaussians_(max_gaussians),
        iterations_(iterations),
        seed_(seed),
        dead_(exec),
        drawable_(exec),
        key_(exec),
        id_(exec),
        target_(exec),
        place_(exec),
        totals_(exec, 2) {
    split_shape const& split = options.split;
    if (!(split.share > 0 && split.share < 1))
      throw invalid_argument("split_shape.share is " + std::to_string(split.share) + ": more than 0, less than 1");
    if (!(split.opacity > 0 && split.opacity <= 1))
      throw invalid_argument("split_shape.opacity is " + std::to_string(split.opacity) + ": more than 0, at most 1");
  }

  /// Every step, with the moments that the step's backward pass left ([N][moment_stride]), before the optimizer's step:
  /// adds to the statistic, and to `gradient` that of the penalty.
  void accumulate(gaussians<E> const& model, span<float const> moments, gaussians<E>& gradient) {
    add_errors(model, moments);
    add_penalty(model, gradient, model.size());
  }
  /// The first part of it: the errors of one of a step's views.
  void add_errors(gaussians<E> const& model, span<float const> moments) {
    if (index_t const n = model.size())
      parallel_for(*exec_, "error_sum", n, detail::error_sum_kernel{moments.data(), statistic_of(n).data()});
  }
  /// And the second; `total`: Gaussians of the scene, where `model` are not all.
  void add_penalty(gaussians<E> const& model, gaussians<E>& gradient, index_t total) {
    if (model.size() && options_.opacity_penalty > 0)
      parallel_for(*exec_, "error_penalty", model.size(),
                   detail::error_penalty_kernel{model.opacity.data(), gradient.opacity.data(),
                                                options_.opacity_penalty / static_cast<float>(total)});
  }

  /// The statistic of so many, for who adds to it; of another count than before it is zero.
  span<float> statistic_of(index_t n) {
    if (error_sum.size() != n) error_sum.resize(n), error_sum.zero();
    return error_sum.view();
  }

  /// From the next step on the schedules are those of a run of so many steps.
  void set_iterations(int iterations) { iterations_ = iterations; }
  /// Steps are counted in images, of which each has so many.
  void set_batch(int images) { batch_ = images; }

  /// Whether the step densifies.
  bool due(int step) const {
    return step > options_.from && is_multiple(step, options_.every, batch_) &&
           static_cast<float>(step) < options_.until * static_cast<float>(iterations_);
  }

  /// The count that a run is to have after a step.
  index_t budget_at(int step) const {
    double const filled = static_cast<double>(options_.fill) * iterations_ - options_.from;
    double const share = filled > 0 ? std::clamp((step - options_.from) / filled, 0.0, 1.0) : 1.0;
    return static_cast<index_t>(std::sqrt(share) * max_gaussians_);
  }

  /// After the optimizer's step.
  template <class Rows = all_rows>
  density_change after_step(gaussians<E>& model, optimizer_state<E>& state, int step, Rows&& rows = {},
                            span<float const> filter = {}) {
    return due(step) ? densify(model, state, step, rows, filter) : density_change{};
  }

  /// Splits those with the most error, and moves the dead. `rows`: all_rows, or as it; `filter`: as opacity_shown has
  /// it.
  template <class Rows = all_rows>
  density_change densify(gaussians<E>& model, optimizer_state<E>& state, int step, Rows&& rows = {},
                         span<float const> filter = {}) {
    stage_scope stage(*exec_, "densify");
    density_change change;
    index_t const here = model.size(), n = rows.total(here);
    row_owners const owners = rows.owners();
    if (n == 0) return change;
    float const* const errors = statistic_of(here).data();
    dead_.resize(here), drawable_.resize(here), key_.resize(here), id_.resize(here), place_.resize(n);
    parallel_for(*exec_, "error_keys", here,
                 detail::error_key_kernel{std::as_const(model).view(),
                                          owners,
                                          errors,
                                          options_.dead_opacity,
                                          filter.data(),
                                          {seed_, static_cast<u32>(step), random_use::growth},
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
    index_t const goal = std::min(budget_at(step), max_gaussians_);
    change.added = std::min(goal > n ? goal - n : 0, drawable - change.relocated);
    if (change.any()) {
      sort_pairs(*exec_, key_.view(), id_.view(), 32);
      index_t const draws = change.relocated + change.added;
      target_.resize(std::max(dead, draws));
      if (dead)
        parallel_for(*exec_, "error_targets", n,
                     detail::error_target_kernel{dead_.data(), place_.data(), target_.data()});
      // Past the dead, the rows that are new.
      parallel_for(*exec_, "error_append", change.added, detail::number_rows{target_.data() + change.relocated, n});
      index_t const next = rows.here(n + change.added);
      model.resize_keep(next), state.first.resize_keep(next), state.second.resize_keep(next);
      span<u32 const> const from(id_.data(), draws), to(target_.data(), draws);
      rows.copy(*exec_, model, from, to);
      clear_moments(*exec_, state, to, owners);
      for (bool const second : {false, true})
        parallel_for(*exec_, "error_split", draws,
                     detail::error_split_kernel{model.view(), (second ? to : from).data(), owners, options_.split,
                                                second, 1.01f * options_.dead_opacity});
    }
    error_sum.resize(model.size()), error_sum.zero();
    return change;
  }

 private:
  E* exec_;
  error_growth_options options_;
  index_t max_gaussians_;
  int iterations_, batch_ = 1;
  u64 seed_;
  buffer<u32, E> dead_, drawable_, key_, id_, target_;
  buffer<u64, E> place_, totals_;
};

}  // namespace gart::inline GART_ISA
