#pragma once
/// \file
/// Adaptive density control (Kerbl et al., 3D Gaussian Splatting for Real-Time Radiance Field Rendering, 2023). A
/// Gaussian with a large mean gradient in image space is cloned if small, and split in two if large. Transparent and
/// oversized ones are removed; opacities are reset from time to time.
///
/// The statistic. 3DGS compares a threshold with the loss's gradient by the mean's screen position, in coordinates -1
/// to 1. Ray tracing has no such variable, but sideways motion acts through it. With the mean at (x, y, z) in the
/// camera, ndc_x = 2 (fx x / z + cx) / W - 1. So dL/dx = dL/dndc_x * 2 fx / (W z), hence
///   dL/dndc = (dL/dx * z W / (2 fx), dL/dy * z H / (2 fy)),
/// whose length is added up at every step that gives the Gaussian a gradient. The mean over those steps meets the same
/// threshold as in 3DGS. A Gaussian whose mean is behind the camera adds nothing in that step.
///
/// Past the budget the largest statistics grow and the rest stay as they are. New Gaussians begin with zero moments.
/// Gaussians that are not finite are removed. A split moves its children by draws from itself. Removing a Gaussian
/// renumbers those after it, and rows move to the rank of their new number. Cost: one small launch a step. A
/// densification is O(N) with one host read, and needs a second copy of the parameters.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/math/logit.hpp>
#include <gart/math/quaternion.hpp>
#include <gart/optim/options.hpp>
#include <gart/optim/random.hpp>
#include <gart/scene/camera.hpp>
#include <gart/train/densify/densifier.hpp>

#include <algorithm>
#include <utility>

namespace gart { inline namespace GART_ISA {

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

// The source of each row of the new arrays, and its kind.
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

// New rows have no moments.
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
class adaptive_density final : public densifier<E> {
 public:
  /// The statistic since the last densification, for checkpoints. [N] each.
  buffer<float, E> gradient_sum;
  buffer<u32, E> touched;  ///< steps that met it

  /// `extent` is the scene's, in world units.
  adaptive_density(E& exec, adc_options const& options, index_t max_gaussians, int iterations, float extent, u64 seed)
      : densifier<E>({options.from, options.every, options.until}, iterations),
        gradient_sum(exec),
        touched(exec),
        exec_(&exec),
        options_(options),
        max_gaussians_(max_gaussians),
        extent_(extent),
        seed_(seed),
        outcome_(exec),
        copies_(exec),
        grows_(exec),
        origin_(exec),
        offset_(exec),
        totals_(exec, 2) {}
  /// For a run.
  adaptive_density(E& exec, density_setup const& run)
      : adaptive_density(exec, options_of(run.options), run.options.max_gaussians, run.options.iterations,
                         run.data.extent, run.options.seed) {}

  bool by_gradient() const override { return true; }
  void observe(gaussians<E> const& model, gaussians<E> const& gradient, camera const& view) override {
    if (touched.size() != model.size()) clear_statistic(model.size());
    parallel_for(*exec_, "adc_accumulate", model.size(),
                 detail::adc_accumulate_kernel{model.view(), gradient.view(), view.rotation[0], view.rotation[1],
                                               view.rotation[2], vec3(view.position),
                                               0.5f * static_cast<float>(view.width) / pixels_per_radian(view).x,
                                               0.5f * static_cast<float>(view.height) / pixels_per_radian(view).y,
                                               gradient_sum.data(), touched.data()});
  }
  /// Densification and the reset of opacities, where they are due.
  density_change step(trained_gaussians<E>& g, density_step<E> const& now) override {
    density_change change;
    if (this->due(now.step)) change = densify(g, now);
    if (this->running(now.step) && is_multiple(now.step, options_.opacity_reset_every, this->batch_)) reset_opacity(g);
    return change;
  }
  void save(named_arrays& state) const override {
    state.set("adc/gradient_sum", gradient_sum.to_host()), state.set("adc/touched", touched.to_host());
  }
  void load(named_arrays const& state) override {
    gradient_sum.assign(state.get<float>("adc/gradient_sum")), touched.assign(state.get<u32>("adc/touched"));
    if (gradient_sum.size() != touched.size()) clear_statistic(0);
  }

  /// Clones, splits and prunes.
  density_change densify(trained_gaussians<E>& g, density_step<E> const& now) {
    stage_scope stage(*exec_, "densify");
    density_change change;
    auto const [rows, here, n, owners] = rows_of(g, now);
    if (n == 0) return change;
    if (touched.size() != here) clear_statistic(here);

    bool const was_reset = options_.opacity_reset_every > 0 && now.step > options_.opacity_reset_every;
    detail::adc_rule const rule{std::as_const(g.model).view(),
                                gradient_sum.data(),
                                touched.data(),
                                options_.gradient,
                                options_.prune_opacity,
                                options_.dense * extent_,
                                was_reset ? options_.prune_scale * extent_ : INFINITY,
                                now.filter.data()};
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
      index_t const next = static_cast<index_t>(total);
      buffer<u32, E>& made = grows_;
      origin_.resize(next), made.resize(next);
      parallel_for(*exec_, "adc_place", n,
                   detail::adc_place_kernel{outcome_.data(), offset_.data(), origin_.data(), made.data()});
      g.take(*exec_, rows, span<u32 const>(origin_));
      for_each_element(*exec_, "adc_clear", g.size(), g.model.sh_degree(),
                       detail::adc_clear_body{g.moments.first.view(), g.moments.second.view(), made.data(), owners});
      parallel_for(*exec_, "adc_split", g.size(),
                   detail::adc_split_kernel{
                       g.model.view(), made.data(), owners, {seed_, static_cast<u32>(now.step), random_use::split}});
    }
    clear_statistic(g.size());
    return change;
  }

  /// Opacities above twice prune_opacity become that.
  void reset_opacity(trained_gaussians<E>& g) {
    double const ceiling = std::min(2.0 * static_cast<double>(options_.prune_opacity), 0.99);
    parallel_for(*exec_, "adc_reset", g.size(),
                 detail::adc_reset_kernel{g.model.opacity.data(), static_cast<float>(logit_in_double(ceiling))});
    g.moments.first.opacity.zero(), g.moments.second.opacity.zero();
  }

 private:
  static adc_options options_of(train_options const& options) {
    adc_options a = options.adc;
    a.prune_opacity = least_opacity(a.prune_opacity, options.render.alpha_min);
    return a;
  }

  void clear_statistic(index_t n) {
    gradient_sum.resize(n), touched.resize(n);
    gradient_sum.zero(), touched.zero();
  }

  E* exec_;
  adc_options options_;
  index_t max_gaussians_;
  float extent_;
  u64 seed_;
  buffer<u32, E> outcome_, copies_, grows_, origin_;
  buffer<u64, E> offset_, totals_;
};

}}  // namespace gart::GART_ISA
