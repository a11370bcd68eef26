#pragma once
// PROTOTYPE
#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/optim/mcmc.hpp>
#include <gart/train/try.hpp>

namespace gart {

struct error_growth_options {
  int from = 500, every = 100;
  float fill = 0.5f, until = 0.8333f, curve = 0.5f;
  float dead_opacity = 0.005f;
  float noise = 0, noise_until = 0.9f;
  float opacity_penalty = 0, scale_penalty = 0, decay = 0.0f;
  int seen_penalty = 1, moments = 1, by = 0, split = 1;
  float d = 0.8f, c = 0.6f, h = 1.0f, q = 0.8333f, power = 1, burst = 1;
  int fresh = 1;
};

namespace detail {

struct error_statistic_kernel {
  float const* moments;
  gaussians_view<float const> gradient;
  float* sum;
  u32* views;
  int by;
  GART_HD void operator()(index_t i) const {
    float e = moments[std::size_t{moment_stride} * i + error_place];
    if (!(e > 0)) return;
    sum[i] += e;
    views[i] += 1;
  }
};

struct error_weight_kernel {
  gaussians_view<float const> model;
  float const* sum;
  u32 const* views;
  float dead_opacity, power;
  int by;
  u32 least_views;
  random_source random;
  u32* dead;
  u32* fit;
  u32* key;
  u32* id;
  GART_HD void operator()(index_t i) const {
    float const o = sigmoid(model.opacity[i]);
    bool alive = o > dead_opacity && is_finite(model.opacity[i]);
    for (index_t c = 0; c < geometry_columns; ++c) alive = alive && is_finite(row_element(model, i, c));
    dead[i] = !alive;
    float w = by == 2 ? o : views[i] < least_views ? 0.0f : by == 1 ? sum[i] : sum[i] / static_cast<float>(views[i]);
    if (power != 1) w = powf(w, power);
    bool const fits = alive && w > 0 && is_finite(w);
    fit[i] = fits;
    float const u = (static_cast<float>(random.words(i).v[0] >> 8) + 0.5f) * 0x1p-24f;
    key[i] = fits ? float_to_bits(-logf(u) / w) : 0xffffffffu;
    id[i] = i;
  }
};

struct error_target_kernel {
  u32* target;
  index_t dead, first;
  GART_HD void operator()(index_t j) const { target[dead + j] = first + j; }
};

struct error_copy_body {
  gaussians_view<float> model, first, second;
  u32 const* source;
  u32 const* target;
  int mode;
  GART_HD void operator()(index_t draw, index_t column) const {
    index_t const from = source[draw], to = target[draw];
    row_element(model, to, column) = row_element(model, from, column);
    if (mode == 0) {
      row_element(first, to, column) = row_element(first, from, column) = 0;
      row_element(second, to, column) = row_element(second, from, column) = 0;
    } else if (mode == 1) {
      row_element(first, to, column) = row_element(second, to, column) = 0;
    } else if (mode == 2) {
      row_element(first, to, column) = row_element(first, from, column) = 0;
      row_element(second, to, column) = row_element(second, from, column);
    } else {
      row_element(first, to, column) = row_element(first, from, column);
      row_element(second, to, column) = row_element(second, from, column);
    }
  }
};

struct error_split_kernel {
  gaussians_view<float> model;
  u32 const* source;
  u32 const* target;
  float d, c, h, q;
  int split;
  float least;
  GART_HD void operator()(index_t draw) const {
    std::size_t const rows[2] = {source[draw], target[draw]};
    float const* const s = model.log_scale + 3 * rows[0];
    int const k = s[0] >= s[1] ? (s[0] >= s[2] ? 0 : 2) : (s[1] >= s[2] ? 1 : 2);
    float const* const q4 = model.quaternion + 4 * rows[0];
    float const norm = q4[0] * q4[0] + q4[1] * q4[1] + q4[2] * q4[2] + q4[3] * q4[3];
    float const o = sigmoid(model.opacity[rows[0]]);
    float const i = norm > 1e-16f ? 1.0f / sqrtf(norm) : 0.0f;
    float const w = q4[0] * i, x = q4[1] * i, y = q4[2] * i, z = q4[3] * i;
    float const axis[3] = {k == 0 ? 1 - 2 * (y * y + z * z) : k == 1 ? 2 * (x * y - w * z) : 2 * (x * z + w * y),
                           k == 0 ? 2 * (x * y + w * z) : k == 1 ? 1 - 2 * (x * x + z * z) : 2 * (y * z - w * x),
                           k == 0 ? 2 * (x * z - w * y) : k == 1 ? 2 * (y * z + w * x) : 1 - 2 * (x * x + y * y)};
    float shift = d * expf(s[k]);
    float opacity = q * o;
    float add[3];
    for (int j = 0; j < 3; ++j) add[j] = logf(j == k ? c : h);
    if (!split) {
      relocated_shape const r = relocation(fmin(static_cast<double>(o), 1 - 1e-7), 2, 2);
      opacity = static_cast<float>(r.opacity), shift = 0;
      for (int j = 0; j < 3; ++j) add[j] = logf(static_cast<float>(r.scale_factor));
    }
    opacity = fminf(fmaxf(opacity, least), 1 - 1e-6f);
    float const logit = logf(opacity / (1 - opacity));
    float mean[3], scale[3];
    for (int j = 0; j < 3; ++j) mean[j] = model.mean[3 * rows[0] + j], scale[j] = s[j] + add[j];
    for (int r = 0; r < 2; ++r) {
      for (int j = 0; j < 3; ++j) {
        model.mean[3 * rows[r] + j] = mean[j] + (r ? -shift : shift) * axis[j];
        model.log_scale[3 * rows[r] + j] = scale[j];
      }
      model.opacity[rows[r]] = logit;
    }
  }
};

struct error_reset_kernel {
  float* opacity;
  float most;
  GART_HD void operator()(index_t i) const {
    if (opacity[i] > most) opacity[i] = most;
  }
};

struct error_decay_kernel {
  float* opacity;
  float keep, least;
  GART_HD void operator()(index_t i) const {
    float o = sigmoid(opacity[i]);
    if (!(o > least)) return;
    o *= keep;
    opacity[i] = logf(o / (1 - o));
  }
};

}  // namespace detail

template <execution E>
class error_growth {
 public:
  buffer<float, E> error_sum;
  buffer<u32, E> views;

  error_growth(E& exec, index_t max_gaussians, int iterations, float extent, u64 seed)
      : error_sum(exec), views(exec), exec_(&exec), max_gaussians_(max_gaussians), iterations_(iterations),
        extent_(extent), seed_(seed), dead_(exec), fit_(exec), key_(exec), id_(exec), target_(exec), before_(exec),
        totals_(exec, 2) {
    auto& o = options_;
    o.from = static_cast<int>(tried("from", 500)), o.every = static_cast<int>(tried("every", 100));
    o.fill = tried("fill", 0.5f), o.until = tried("until", 0.8333f), o.curve = tried("curve", 0.5f);
    o.noise = tried("noise", 0) * 5e5f, o.noise_until = tried("noise_until", 0.9f);
    o.opacity_penalty = 0.01f * tried("op", 0), o.scale_penalty = 0.01f * tried("sp", 0), o.decay = tried("decay", 0);
    o.seen_penalty = static_cast<int>(tried("seen", 1)), o.moments = static_cast<int>(tried("moments", 1));
    o.by = static_cast<int>(tried("by", 0)), o.split = static_cast<int>(tried("split", 1));
    o.d = tried("d", 0.8f), o.c = tried("c", 0.6f), o.h = tried("h", 1), o.q = tried("q", 0.8333f);
    o.power = tried("power", 1), o.burst = tried("burst", 1);
  }

  void set_start(index_t n) { start_ = n; }

  void penalties(gaussians<E> const& model, gaussians<E>& gradient) {
    if (options_.opacity_penalty == 0 && options_.scale_penalty == 0) return;
    float const n = static_cast<float>(model.size());
    parallel_for(*exec_, "penalties", model.size(),
                 detail::seen_penalty_kernel{model.view(), gradient.view(), options_.opacity_penalty / n,
                                             options_.scale_penalty / (3 * n * extent_), options_.seen_penalty});
  }

  void accumulate(gaussians<E> const& gradient, span<float const> moments) {
    index_t const n = gradient.size();
    if (views.size() != n) clear(n);
    if (moments.size() < std::size_t{moment_stride} * n) return;
    parallel_for(*exec_, "error_statistic", n,
                 detail::error_statistic_kernel{moments.data(), gradient.view(), error_sum.data(), views.data(),
                                                options_.by});
  }

  bool due(int step) const {
    return step > options_.from && step < options_.until * static_cast<float>(iterations_) &&
           step % options_.every == 0;
  }

  density_change after_step(gaussians<E>& model, optimizer_state<E>& state, int step, float mean_rate) {
    density_change change;
    if (due(step)) change = densify(model, state, step);
    int const reset = static_cast<int>(tried("reset", 0));
    if (reset > 0 && step % reset == 0 && step < tried("reset_until", 0.45f) * static_cast<float>(iterations_)) {
      float const most = tried("reset_to", 0.05f);
      parallel_for(*exec_, "error_reset", model.size(), detail::error_reset_kernel{model.opacity.data(), std::log(most / (1 - most))});
      state.first.opacity.zero(), state.second.opacity.zero();
    }
    if (options_.noise > 0 && step < options_.noise_until * static_cast<float>(iterations_))
      parallel_for(*exec_, "noise", model.size(),
                   detail::mcmc_noise_kernel{model.view(),
                                             {seed_, static_cast<u32>(step), random_use::noise},
                                             options_.noise * mean_rate / (extent_ * extent_),
                                             options_.dead_opacity});
    return change;
  }

  density_change densify(gaussians<E>& model, optimizer_state<E>& state, int step) {
    stage_scope stage(*exec_, "densify");
    density_change change;
    index_t const n = model.size();
    if (n == 0) return change;
    if (views.size() != n) clear(n);
    dead_.resize(n), fit_.resize(n), key_.resize(n), id_.resize(n), before_.resize(n);
    parallel_for(*exec_, "error_weights", n,
                 detail::error_weight_kernel{std::as_const(model).view(), error_sum.data(), views.data(),
                                             options_.dead_opacity, options_.power, options_.by,
                                             static_cast<u32>(tried("minv", 1)),
                                             {seed_, static_cast<u32>(step), random_use::growth}, dead_.data(),
                                             fit_.data(), key_.data(), id_.data()});
    exclusive_scan(*exec_, span<u32 const>(fit_), before_.view(), totals_.view().subspan(1, 1));
    exclusive_scan(*exec_, span<u32 const>(dead_), before_.view(), totals_.view().subspan(0, 1));
    u64 totals[2];
    exec_->copy_out(totals, totals_.data(), sizeof totals);
    index_t dead = static_cast<index_t>(totals[0]), fit = static_cast<index_t>(totals[1]);
    double const p = (step - options_.from) / std::max(1.0, static_cast<double>(options_.fill) * iterations_ - options_.from);
    double const share = p >= 1 ? 1.0 : std::pow(p, static_cast<double>(options_.curve));
    double goal = start_ + (static_cast<double>(max_gaussians_) - start_) * share;
    goal = std::min(std::max(goal, static_cast<double>(n)), static_cast<double>(max_gaussians_));
    goal = std::min(goal, n * (1.0 + options_.burst));
    index_t added = static_cast<index_t>(goal) - n;
    if (dead > fit) dead = fit;
    if (added > fit - dead) added = fit - dead;
    change.relocated = dead, change.added = added;
    index_t const draws = dead + added;
    if (draws) {
      sort_pairs(*exec_, key_.view(), id_.view(), 32);
      target_.resize(totals[0] + added);
      if (totals[0])
        parallel_for(*exec_, "error_list", n, detail::mcmc_list_kernel{dead_.data(), before_.data(), target_.data()});
      if (added) {
        model.resize_keep(n + added), state.first.resize_keep(n + added), state.second.resize_keep(n + added);
        parallel_for(*exec_, "error_append", added, detail::error_target_kernel{target_.data(), dead, n});
      }
      for_each_element(*exec_, "error_copy", draws, model.sh_degree(),
                       detail::error_copy_body{model.view(), state.first.view(), state.second.view(), id_.data(),
                                               target_.data(), options_.moments});
      parallel_for(*exec_, "error_split", draws,
                   detail::error_split_kernel{model.view(), id_.data(), target_.data(), options_.d, options_.c,
                                              options_.h, options_.q, options_.split, options_.dead_opacity * 1.01f});
    }
    if (options_.decay > 0)
      parallel_for(*exec_, "error_decay", model.size(),
                   detail::error_decay_kernel{model.opacity.data(), 1 - options_.decay, 0.0f});
    clear(model.size());
    return change;
  }

 private:
  void clear(index_t n) {
    error_sum.resize(n), views.resize(n);
    error_sum.zero(), views.zero();
  }
  E* exec_;
  error_growth_options options_;
  index_t max_gaussians_, start_ = 0;
  int iterations_;
  float extent_;
  u64 seed_;
  buffer<u32, E> dead_, fit_, key_, id_, target_;
  buffer<u64, E> before_, totals_;
};

}  // namespace gart
