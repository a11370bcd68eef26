#pragma once
/// \file
/// Exposures of the training views, learned with the Gaussians (exposure.hpp): applied to the rendered image before the
/// loss, and moved by Adam, the twelve numbers of the step's view alone. With x' the exposed image,
///   dL/dx = M^T dL/dx',   dL/dM = sum over pixels of dL/dx' (x, 1)^T.
///
/// The scene's own colours are those of an exposure that is the identity; nothing holds the views' mean to it but that
/// they start there.
///
/// Buffers: 37 words a view, a copy of the image, and a few sums. Cost: two passes over the image and three launches
/// over a few numbers a step; no host read. The order of all sums depends on the image's size only. A number whose
/// gradient is not finite stays as it is.

#include <gart/algorithm/segmented_reduce.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exposure/exposure.hpp>
#include <gart/math/arith.hpp>
#include <gart/optim/adam.hpp>

namespace gart::inline GART_ISA {

namespace detail {

struct expose_kernel {
  exposure const* view;
  float strength;
  float const* image;
  float* exposed;
  GART_KERNEL void operator()(index_t pixel) const {
    float const* const x = image + std::size_t{3} * pixel;
    exposure const e = faded(*view, strength);
    for (int c = 0; c < 3; ++c) exposed[std::size_t{3} * pixel + c] = e.channel(c, x[0], x[1], x[2]);
  }
};

// A lane takes every lanes-th pixel, turns its gradient and sums what it says of the exposure.
struct exposure_gradient_kernel {
  exposure const* view;
  float strength;
  float const* image;
  float* gradient;  // in: dL/dx', out: dL/dx
  index_t pixels, lanes;
  float* sums;  // [lanes][12]

  GART_KERNEL void operator()(index_t lane) const {
    exposure const e = faded(*view, strength);
    float sum[exposure::floats] = {};
    for (index_t pixel = lane; pixel < pixels; pixel += lanes) {
      float const* const x = image + std::size_t{3} * pixel;
      float* const g = gradient + std::size_t{3} * pixel;
      float const d[3] = {g[0], g[1], g[2]};
      for (int c = 0; c < 3; ++c) {
        for (int k = 0; k < 3; ++k) sum[4 * c + k] = fma(d[c], x[k], sum[4 * c + k]);
        sum[4 * c + 3] += d[c];
        g[c] = fma(e.m[c], d[0], fma(e.m[4 + c], d[1], e.m[8 + c] * d[2]));
      }
    }
    for (int k = 0; k < exposure::floats; ++k) sums[std::size_t{exposure::floats} * lane + k] = strength * sum[k];
  }
};

struct exposure_adam_kernel {
  float const* gradient;
  float* value;
  float* first;
  float* second;
  adam_rule rule;
  float rate;

  GART_KERNEL void operator()(index_t k) const {
    auto const to = rule.moved<float>({value[k], first[k], second[k]}, gradient[k], rate);
    if (!is_finite(to.second) || !is_finite(to.parameter)) return;
    value[k] = to.parameter, first[k] = to.first, second[k] = to.second;
  }
};

}  // namespace detail

/// The exposures of a run, and Adam's moments of them.
template <execution E>
class exposure_training {
 public:
  /// As many identities as there are views.
  exposure_training(E& exec, std::size_t views)
      : exec_(&exec),
        value_(exec, identities(views)),
        first_(exec, std::vector<float>(views * exposure::floats)),
        second_(exec, std::vector<float>(views * exposure::floats)),
        visits_(views),
        exposed_(exec),
        sums_(exec),
        gradient_(exec, exposure::floats),
        ends_(exec, std::vector<u32>(runs + 1)) {
    std::vector<u32> ends(runs + 1);
    for (u32 r = 0; r <= runs; ++r) ends[r] = r * runs;
    ends_.assign(ends);
  }

  /// The share of the exposures that is applied from now on (faded); 1 at first.
  void set_strength(float strength) { strength_ = strength; }

  /// The image [H][W][3] as the view's photograph would show it; until the next call.
  span<float const> expose(std::size_t view, span<float const> image) {
    exposed_.resize(image.size());
    parallel_for(*exec_, "expose", static_cast<index_t>(image.size() / 3),
                 detail::expose_kernel{at(view), strength_, image.data(), exposed_.data()});
    return exposed_;
  }

  /// Turns dL/d exposed into dL/d image, and takes Adam's step for the view.
  void step(std::size_t view, span<float const> image, span<float> gradient, float rate) {
    differentiate(view, image, gradient);
    move(view, rate);
  }

  /// The first half of a step: turns dL/d exposed into dL/d image. What it says of the exposure, [12], stays until the
  /// next call.
  span<float const> differentiate(std::size_t view, span<float const> image, span<float> gradient) {
    constexpr index_t lanes = runs * runs;
    sums_.resize(std::size_t{lanes + runs} * exposure::floats);
    auto const by_lane = sums_.view().subspan(0, std::size_t{lanes} * exposure::floats);
    auto const by_run = sums_.view().subspan(by_lane.size(), std::size_t{runs} * exposure::floats);
    parallel_for(*exec_, "exposure_gradient", lanes,
                 detail::exposure_gradient_kernel{at(view), strength_, image.data(), gradient.data(),
                                                  static_cast<index_t>(image.size() / 3), lanes, by_lane.data()});
    span<u32 const> const ends = ends_;
    segmented_reduce(*exec_, by_lane, exposure::floats, ends, by_run);
    segmented_reduce(*exec_, by_run, exposure::floats, ends.subspan(0, 2), gradient_.view());
    return gradient_;
  }

  /// The second, of another rank's view: by its gradient, [12], in host memory.
  void move(std::size_t view, span<float const> gradient, float rate) {
    gradient_.assign(std::vector<float>(gradient.begin(), gradient.end()));
    move(view, rate);
  }

  /// For a checkpoint.
  exposure_state state() const { return {value_.to_host(), first_.to_host(), second_.to_host(), visits_}; }
  /// From a checkpoint.
  void set_state(exposure_state const& s) {
    value_.assign(s.value), first_.assign(s.first), second_.assign(s.second), visits_ = s.visits;
  }

 private:
  static constexpr index_t runs = E::device ? 128 : 8;  // of as many lanes: two short sums, not a long one
  static std::vector<float> identities(std::size_t views) {
    exposure const identity;
    std::vector<float> all;
    for (std::size_t v = 0; v < views; ++v) all.insert(all.end(), identity.m, identity.m + exposure::floats);
    return all;
  }
  exposure* at(std::size_t view) { return reinterpret_cast<exposure*>(value_.data()) + view; }

  // Adam's step for the view, by gradient_.
  void move(std::size_t view, float rate) {
    std::size_t const row = view * exposure::floats;
    int const visit = static_cast<int>(++visits_[view]);
    adam_options const adam;
    parallel_for(*exec_, "exposure_adam", exposure::floats,
                 detail::exposure_adam_kernel{gradient_.data(), value_.data() + row, first_.data() + row,
                                              second_.data() + row, adam_rule(adam, visit),
                                              static_cast<float>(rate * adam_rule::first_correction(adam, visit))});
  }

  E* exec_;
  buffer<float, E> value_, first_, second_;
  std::vector<u32> visits_;
  buffer<float, E> exposed_, sums_, gradient_;
  buffer<u32, E> ends_;
  float strength_ = 1;
};

}  // namespace gart::inline GART_ISA
