#pragma once
/// \file
/// Adaptive density control (Kerbl et al., 3D Gaussian Splatting for Real-Time Radiance Field Rendering, 2023):
/// Gaussians whose image-space gradient is large on average are cloned (small ones) or split in two (large ones);
/// transparent and oversized ones are removed; opacities are reset now and then.
///
/// The statistic. 3DGS thresholds the gradient of the loss in the mean's place on the screen, in coordinates -1 to 1.
/// Ray tracing has no such variable, but sideways motion acts through it: with the mean at (x, y, z) in the camera,
/// ndc_x = 2 (fx x / z + cx) / W - 1, so dL/dx = dL/dndc_x * 2 fx / (W z), hence
///   dL/dndc = (dL/dx * z W / (2 fx), dL/dy * z H / (2 fy)),
/// whose length is added up at every step that gives the Gaussian a gradient; the mean over those steps meets the same
/// threshold as in 3DGS. A Gaussian whose mean is behind the camera adds nothing in that step.
///
/// Past the budget the largest statistics grow and the rest stay as they are. New Gaussians begin with zero moments.
/// Gaussians that are not finite are removed. A split moves its halves by draws from itself. What is removed closes the
/// ranks of those behind it: every number may change, and where rows are spread over ranks they move with their
/// numbers. Cost: one small launch a step; a densification is O(N) with one host read, and holds a second copy of the
/// parameters while it runs.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/math/logit.hpp>
#include <gart/math/quaternion.hpp>
#include <gart/optim/adam.hpp>
#include <gart/optim/options.hpp>
#include <gart/optim/random.hpp>
#include <gart/optim/rows.hpp>
#include <gart/optim/schedule.hpp>
#include <gart/scene/camera.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gart::inline GART_ISA {

namespace detail {

struct adc_accumulate_kernel {
  gaussians_view<float const> model, gradient;
  vec3 right, down, forward, centre;
  float scale_x, scale_y;  // W / (2 fx), H / (2 fy)
  float* sum;
  u32* touched;

  GART_KERNEL void operator()(index_t i) const {
    std::size_t const r = std::size_t{3} * i;
    vec3 const g(gradient.mean[r], gradient.mean[r + 1], gradient.mean[r + 2]);
    if (g.x == 0 && g.y == 0 && g.z == 0 && gradient.opacity[i] == 0) return;
    vec3 const p = vec3(model.mean[r], model.mean[r + 1], model.mean[r + 2]) - centre;
    float const z = p.x * forward.x + p.y * forward.y + p.z * forward.z;
    float const x = (g.x * right.x + g.y * right.y + g.z * right.z) * scale_x * z;
    float const y = (g.x * down.x + g.y * down.y + g.z * down.z) * scale_y * z;
    float const length = sqrtf(x * x + y * y);
    if (!(z > 0) || !is_finite(length)) return;
    sum[i] += length;
    touched[i] += 1;
  }
};

// What becomes of a Gaussian: it leaves none, itself, itself and a copy, or two others.
inline constexpr u32 adc_gone = 0, adc_stays = 1, adc_cloned = 2, adc_split = 3;

struct adc_rule {
  gaussians_view<float const> model;
  float const* sum;
  u32 const* touched;
  float gradient, prune_opacity;
  float split_scale;    // larger ones split
  float prune_scale;    // larger ones go
  float const* filter;  // or null

  GART_HD float statistic(index_t i) const { return touched[i] ? sum[i] / static_cast<float>(touched[i]) : 0.0f; }
  GART_HD float largest_scale(index_t i) const {
    float const* const s = model.log_scale + std::size_t{3} * i;
    return expf(fmaxf(s[0], fmaxf(s[1], s[2])));
  }
  GART_HD u32 outcome(index_t i) const {
    bool finite = is_finite(model.opacity[i]);
    for (index_t c = 0; c < geometry_columns; ++c) finite = finite && is_finite(row_element(model, i, c));
    float const opacity = opacity_shown(model, i, filter), scale = largest_scale(i);
    if (!finite || !(opacity >= prune_opacity)) return adc_gone;
    bool const grows = statistic(i) >= gradient;
    bool const split = grows && scale > split_scale;
    if ((split ? scale / 1.6f : scale) > prune_scale) return adc_gone;
    return split ? adc_split : grows ? adc_cloned : adc_stays;
  }
};

struct adc_plan_kernel {
  adc_rule rule;
  u32* outcome;
  GART_KERNEL void operator()(index_t i) const { outcome[i] = rule.outcome(i); }
};

struct adc_count_kernel {
  u32 const* outcome;
  u32 *copies, *grows;
  GART_KERNEL void operator()(index_t i) const {
    grows[i] = outcome[i] >= adc_cloned;
    copies[i] = grows[i] ? 2 : outcome[i];
  }
};

// Keys that sort the growing Gaussians first, the largest statistic first: the bits of a positive float are ordered.
struct adc_key_kernel {
  adc_rule rule;
  u32 const* outcome;  // by number
  row_owners owners;
  u32* key;
  GART_KERNEL void operator()(index_t i) const {
    key[i] = outcome[owners.global(i)] >= adc_cloned ? ~float_to_bits(rule.statistic(i)) : 0xffffffffu;
  }
};

struct adc_demote_kernel {
  u32 const* id;
  u32 *outcome, *copies;
  index_t first;
  GART_KERNEL void operator()(index_t rank) const { outcome[id[first + rank]] = copies[id[first + rank]] = adc_stays; }
};

// Where each row of the new arrays comes from, and what it is.
struct adc_place_kernel {
  u32 const* outcome;
  u64 const* offset;
  u32 *origin, *made;
  GART_KERNEL void operator()(index_t i) const {
    u32 const o = outcome[i];
    if (o == adc_gone) return;
    u64 const at = offset[i];
    origin[at] = i, made[at] = o == adc_split ? adc_split : adc_stays;
    if (o >= adc_cloned) origin[at + 1] = i, made[at + 1] = o;
  }
};

// What is new has no moments.
struct adc_clear_body {
  gaussians_view<float> first, second;
  u32 const* made;
  row_owners owners;
  GART_KERNEL void operator()(index_t row, index_t column) const {
    if (made[owners.global(row)] != adc_stays) row_element(first, row, column) = row_element(second, row, column) = 0;
  }
};

struct adc_split_kernel {
  gaussians_view<float> model;
  u32 const* made;
  row_owners owners;
  random_source random;
  GART_KERNEL void operator()(index_t i) const {
    u32 const number = static_cast<u32>(owners.global(i));
    if (made[number] != adc_split) return;
    float const* const q = model.quaternion + std::size_t{4} * i;
    float* const mean = model.mean + std::size_t{3} * i;
    float* const log_scale = model.log_scale + std::size_t{3} * i;
    random_normals const n = normals(random.words(number));
    quaternion const turn{q[0], q[1], q[2], q[3]};
    vec3 v(n.v[0] * expf(log_scale[0]), n.v[1] * expf(log_scale[1]), n.v[2] * expf(log_scale[2]));
    if (norm2(turn) > quaternion_norm2_min) v = to_matrix(turn) * v;
    mean[0] += v.x, mean[1] += v.y, mean[2] += v.z;
    for (int c = 0; c < 3; ++c) log_scale[c] -= 0.470003629f;  // log 1.6
  }
};

struct adc_reset_kernel {
  float* opacity;
  float ceiling;
  GART_KERNEL void operator()(index_t i) const {
    if (opacity[i] > ceiling) opacity[i] = ceiling;
  }
};

}  // namespace detail

/// Steps count from 1.
template <execution E>
class adaptive_density {
 public:
  /// The statistic since the last densification: what a checkpoint must hold. [N] each.
  buffer<float, E> gradient_sum;
  buffer<u32, E> touched;  ///< steps that met it

  /// `extent` is the scene's, in world units.
  adaptive_density(E& exec, adc_options const& options, index_t max_gaussians, int iterations, float extent, u64 seed)
      : gradient_sum(exec),
        touched(exec),
        exec_(&exec),
        options_(options),
        max_gaussians_(max_gaussians),
        iterations_(iterations),
        extent_(extent),
        seed_(seed),
        outcome_(exec),
        copies_(exec),
        grows_(exec),
        origin_(exec),
        offset_(exec),
        totals_(exec, 2) {}

  /// From the next step on the schedules are those of a run of so many steps.
  void set_iterations(int iterations) { iterations_ = iterations; }
  /// Steps are counted in images, of which each has so many.
  void set_batch(int images) { batch_ = images; }

  /// Every step, with the gradient of each of its views.
  void accumulate(gaussians<E> const& model, gaussians<E> const& gradient, camera const& view) {
    if (touched.size() != model.size()) clear_statistic(model.size());
    parallel_for(*exec_, "adc_accumulate", model.size(),
                 detail::adc_accumulate_kernel{model.view(), gradient.view(), view.rotation[0], view.rotation[1],
                                               view.rotation[2], vec3(view.position),
                                               0.5f * static_cast<float>(view.width) / pixels_per_radian(view).x,
                                               0.5f * static_cast<float>(view.height) / pixels_per_radian(view).y,
                                               gradient_sum.data(), touched.data()});
  }

  /// Whether the step densifies.
  bool due(int step) const {
    return step > options_.from && running(step) && is_multiple(step, options_.every, batch_);
  }

  /// After the optimizer's step: densification and the reset of opacities, where they are due.
  template <class Rows = all_rows>
  density_change after_step(gaussians<E>& model, optimizer_state<E>& state, int step, Rows&& rows = {},
                            span<float const> filter = {}) {
    density_change change;
    if (due(step)) change = densify(model, state, step, rows, filter);
    if (running(step) && is_multiple(step, options_.opacity_reset_every, batch_)) reset_opacity(model, state);
    return change;
  }

  /// Clones, splits and prunes. `rows`: all_rows, or as it; `filter`: as opacity_shown has it.
  template <class Rows = all_rows>
  density_change densify(gaussians<E>& model, optimizer_state<E>& state, int step, Rows&& rows = {},
                         span<float const> filter = {}) {
    stage_scope stage(*exec_, "densify");
    density_change change;
    index_t const here = model.size(), n = rows.total(here);
    row_owners const owners = rows.owners();
    if (n == 0) return change;
    if (touched.size() != here) clear_statistic(here);

    bool const was_reset = options_.opacity_reset_every > 0 && step > options_.opacity_reset_every;
    detail::adc_rule const rule{std::as_const(model).view(),
                                gradient_sum.data(),
                                touched.data(),
                                options_.gradient,
                                options_.prune_opacity,
                                options_.dense * extent_,
                                was_reset ? options_.prune_scale * extent_ : INFINITY,
                                filter.data()};
    outcome_.resize(here);
    parallel_for(*exec_, "adc_plan", here, detail::adc_plan_kernel{rule, outcome_.data()});
    rows.gather(*exec_, outcome_);
    copies_.resize(n), grows_.resize(n), offset_.resize(n);
    parallel_for(*exec_, "adc_count", n, detail::adc_count_kernel{outcome_.data(), copies_.data(), grows_.data()});
    exclusive_scan(*exec_, span<u32 const>(grows_), offset_.view(), totals_.view().subspan(0, 1));
    exclusive_scan(*exec_, span<u32 const>(copies_), offset_.view(), totals_.view().subspan(1, 1));
    u64 totals[2];
    exec_->copy_out(totals, totals_.data(), sizeof totals);
    u64 growing = totals[0], total = totals[1];
    u64 const kept = total - growing;

    if (total > max_gaussians_ && growing > 0) {
      u64 const room = max_gaussians_ > kept ? max_gaussians_ - kept : 0;
      buffer<u32, E>& key = grows_;
      key.resize(here), origin_.resize(n);
      parallel_for(*exec_, "adc_keys", here, detail::adc_key_kernel{rule, outcome_.data(), owners, key.data()});
      rows.gather(*exec_, key);
      parallel_for(*exec_, "adc_numbers", n, detail::number_rows{origin_.data(), 0});
      sort_pairs(*exec_, key.view(), origin_.view(), 32);
      parallel_for(
          *exec_, "adc_demote", static_cast<index_t>(growing - room),
          detail::adc_demote_kernel{origin_.data(), outcome_.data(), copies_.data(), static_cast<index_t>(room)});
      exclusive_scan(*exec_, span<u32 const>(copies_), offset_.view(), totals_.view().subspan(1, 1));
      growing = room, total = kept + room;
    }

    change.added = static_cast<index_t>(growing);
    change.removed = static_cast<index_t>(n - kept);
    if (change.any()) {
      index_t const next = static_cast<index_t>(total), next_here = rows.here(next);
      buffer<u32, E>& made = grows_;
      origin_.resize(next), made.resize(next);
      parallel_for(*exec_, "adc_place", n,
                   detail::adc_place_kernel{outcome_.data(), offset_.data(), origin_.data(), made.data()});
      for (gaussians<E>* each : {&model, &state.first, &state.second}) {
        gaussians<E> taken(*exec_, next_here, each->sh_degree());
        rows.take(*exec_, *each, taken, span<u32 const>(origin_));
        *each = std::move(taken);
      }
      for_each_element(*exec_, "adc_clear", next_here, model.sh_degree(),
                       detail::adc_clear_body{state.first.view(), state.second.view(), made.data(), owners});
      parallel_for(*exec_, "adc_split", next_here,
                   detail::adc_split_kernel{
                       model.view(), made.data(), owners, {seed_, static_cast<u32>(step), random_use::split}});
    }
    clear_statistic(model.size());
    return change;
  }

  /// Opacities above twice prune_opacity become that.
  void reset_opacity(gaussians<E>& model, optimizer_state<E>& state) {
    double const ceiling = std::min(2.0 * static_cast<double>(options_.prune_opacity), 0.99);
    parallel_for(*exec_, "adc_reset", model.size(),
                 detail::adc_reset_kernel{model.opacity.data(), static_cast<float>(logit_in_double(ceiling))});
    state.first.opacity.zero(), state.second.opacity.zero();
  }

 private:
  bool running(int step) const { return static_cast<float>(step) < options_.until * static_cast<float>(iterations_); }

  void clear_statistic(index_t n) {
    gradient_sum.resize(n), touched.resize(n);
    gradient_sum.zero(), touched.zero();
  }

  E* exec_;
  adc_options options_;
  index_t max_gaussians_;
  int iterations_, batch_ = 1;
  float extent_;
  u64 seed_;
  buffer<u32, E> outcome_, copies_, grows_, origin_;
  buffer<u64, E> offset_, totals_;
};

}  // namespace gart::inline GART_ISA
