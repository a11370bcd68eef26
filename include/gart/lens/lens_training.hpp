#pragma once
/// \file
/// Lenses of a capture, learned with the Gaussians. Adam runs on the host, on three numbers for each camera
/// (lens/lens_state.hpp). Views of the same model, size and lens share a camera.
///
/// A gradient that is not finite moves nothing. Each number stays within half the focal length either way, so the focal
/// length stays positive. Cost: none that shows beside the gradient's.

#include <gart/core/named_arrays.hpp>
#include <gart/lens/differentiate_lens.hpp>
#include <gart/lens/lens_state.hpp>
#include <gart/lens/options.hpp>
#include <gart/optim/schedule.hpp>

#include <algorithm>
#include <cmath>
#include <utility>

namespace gart { inline namespace GART_ISA {

/// The lenses of a run.
class lens_training {
 public:
  /// For the capture's cameras of these views. Errors: invalid_argument, naming the view, for a camera without a focal
  /// length.
  lens_training(lens_options const& options, std::vector<named_camera> const& views) : options_(options) {
    for (named_camera const& v : views) {
      visit_camera(v.view, [&]<class M>(M const&) {
        if constexpr (!focal_camera<M>)
          throw invalid_argument("train_options.refine_lens: view " + v.name +
                                 " has no focal length and no principal point to learn (equirectangular)");
      });
      std::size_t const k = find(v.view);
      if (k == captured_.size()) captured_.push_back(v.view);
      of_view_.push_back(k);
    }
    std::size_t const n = captured_.size();
    state_ = {std::vector<double>(3 * n), std::vector<double>(3 * n), std::vector<double>(3 * n), std::vector<u32>(n)};
  }

  /// A camera of the capture, at any pose, with its learned lens; other cameras stay unchanged.
  camera view(camera const& captured) const {
    std::size_t const k = find(captured);
    return k < captured_.size() && state_.visits[k] ? through(captured, numbers(k)) : captured;
  }

  /// Whether lenses move in step `step` of so many.
  bool learns(int step, int iterations) const { return step >= warm_up(iterations); }

  /// Moves the lens of view i by the gradient at its present value.
  void step(std::size_t i, lens_gradient const& by, int step, int iterations) {
    std::size_t const k = of_view_[i];
    camera const& c = captured_[k];
    double const fx = c.fx, fy = c.fy;
    lens_numbers const slope = {by.fx * fx + by.fy * fy, by.cx * fx, by.cy * fy};
    for (double const x : slope)
      if (!std::isfinite(x)) return;
    int const visit = static_cast<int>(++state_.visits[k]), from = warm_up(iterations);
    int const until = static_cast<int>(options_.until * static_cast<float>(iterations));
    double const rate = exponential_decay(options_.rate, options_.rate_final, step - from, until - from);
    double const beta1 = options_.beta1, beta2 = options_.beta2;
    double const first = 1 / (1 - std::pow(beta1, visit)), second = 1 / (1 - std::pow(beta2, visit));
    for (std::size_t j = 0; j < slope.size(); ++j) {
      double &m = state_.first[3 * k + j], &v = state_.second[3 * k + j];
      m = beta1 * m + (1 - beta1) * slope[j], v = beta2 * v + (1 - beta2) * slope[j] * slope[j];
      double& x = state_.value[3 * k + j];
      x -= rate * first * m / (std::sqrt(second * v) + 1e-15);
      x = std::clamp(x, -0.5, 0.5);  // a focal length stays positive
    }
  }

  /// For a checkpoint.
  void save(named_arrays& to) const {
    for_each_array(state_, [&](char const* name, auto const& values) { to.set(name, values); });
  }
  /// The same in memory.
  lens_state const& state() const { return state_; }
  /// From a checkpoint of as many.
  void load(named_arrays const& from) {
    lens_state taken = state_;
    for_each_array(taken, [&](char const* name, auto& values) { from.take(name, values); });
    state_ = std::move(taken);
  }

 private:
  template <class State, class F>
  static void for_each_array(State& s, F const& f) {
    f("lens", s.value), f("lens/first", s.first), f("lens/second", s.second), f("lens/visits", s.visits);
  }
  int warm_up(int iterations) const {
    return std::min(500, static_cast<int>(options_.warm_up * static_cast<float>(iterations)));
  }
  std::size_t find(camera const& view) const {
    auto const at =
        std::find_if(captured_.begin(), captured_.end(), [&](camera const& c) { return same_lens(c, view); });
    return static_cast<std::size_t>(at - captured_.begin());
  }
  lens_numbers numbers(std::size_t k) const {
    return {state_.value[3 * k], state_.value[3 * k + 1], state_.value[3 * k + 2]};
  }

  lens_options options_;
  std::vector<camera> captured_;      // one view of each
  std::vector<std::size_t> of_view_;  // index in captured_ for each training view
  lens_state state_;
};

}}  // namespace gart::GART_ISA
