#pragma once
/// \file
/// Poses of the training views, learned with the Gaussians. Adam runs on the host, on the six numbers of the step's
/// view (pose/pose.hpp), scaled by the metric of its image (pose/pose_metric.hpp). The loss holds a pull to the
/// capture's poses, with translations in units of the scene's extent.
///
/// Moving, turning and scaling the whole capture with its scene changes no image, so no loss holds the views. So once
/// an epoch the similarity nearest to their increments is removed from them,
///   minimise over v, o, s:  sum_i |a_i - v - o x r_i - s r_i|^2 / extent^2 + |b_i - o|^2,
/// a_i and b_i the increments of position and turn in world axes, r_i the position from the mean. The mean position and
/// turn are then the capture's.
///
/// A gradient that is not finite moves nothing. Cost: none that shows; memory: 440 bytes a view.

#include <gart/core/named_arrays.hpp>
#include <gart/optim/options.hpp>
#include <gart/optim/schedule.hpp>
#include <gart/pose/options.hpp>
#include <gart/pose/pose.hpp>
#include <gart/pose/pose_metric.hpp>

#include <algorithm>
#include <array>
#include <utility>

namespace gart { inline namespace GART_ISA {

/// The poses of a run.
class pose_training {
 public:
  /// From the capture's cameras; `extent` is the scene's.
  pose_training(pose_options const& options, std::vector<camera> captured, double extent)
      : options_(options), captured_(std::move(captured)), extent_(extent) {
    std::size_t const n = captured_.size();
    state_ = {std::vector<double>(6 * n), std::vector<double>(6 * n), std::vector<double>(6 * n),
              std::vector<double>(36 * n), std::vector<u32>(n)};
  }

  /// A view's learned camera.
  camera view(std::size_t i) const {
    return state_.visits[i] ? moved(captured_[i], numbers(i), extent_) : captured_[i];
  }

  /// Whether poses move in step `step` of so many.
  bool learns(int step, int iterations) const { return step >= warm_up(iterations); }

  /// Whether view i has no metric yet.
  bool wants_metric(std::size_t i) const { return state_.metric[36 * i] == 0; }
  /// The metric, from depth and transmittance of an image by the view's learned camera.
  std::array<double, 36> metric_of(camera const& view, span<float const> depth, span<float const> transmittance) const {
    return pose_metric(view, depth, transmittance, extent_);
  }
  /// Sets the metric, before the view's first step.
  void set_metric(std::size_t i, std::array<double, 36> const& metric) {
    std::copy(metric.begin(), metric.end(), state_.metric.begin() + static_cast<std::ptrdiff_t>(36 * i));
  }

  /// Moves view i by the gradient at its pose.
  void step(std::size_t i, pose_gradient const& by, int step, int iterations) {
    pose_numbers const at = numbers(i);
    pose_numbers slope = pull_back(captured_[i], at, extent_, by), move;
    int const from = warm_up(iterations), until = static_cast<int>(options_.until * static_cast<float>(iterations));
    auto const between = [&](float first, float last) {
      return double{exponential_decay(first, last, step - from, until - from)};
    };
    metric_root const metric(state_.metric.data() + 36 * i, between(options_.damping, options_.damping_final));
    for (std::size_t k = 0; k < 6; ++k) slope[k] += double{options_.prior} * at[k];
    slope = metric.gradient(slope);
    for (double const x : slope)
      if (!std::isfinite(x)) return;
    int const visit = static_cast<int>(++state_.visits[i]);
    double const rate = between(options_.rate, options_.rate_final);
    double const beta1 = options_.beta1, beta2 = options_.beta2;
    double const first = 1 / (1 - std::pow(beta1, visit)), second = 1 / (1 - std::pow(beta2, visit));
    for (std::size_t k = 0; k < 6; ++k) {
      double &m = state_.first[6 * i + k], &v = state_.second[6 * i + k];
      m = beta1 * m + (1 - beta1) * slope[k], v = beta2 * v + (1 - beta2) * slope[k] * slope[k];
      move[k] = rate * first * m / (std::sqrt(second * v) + 1e-15);
    }
    move = metric.step(move);
    for (std::size_t k = 0; k < 6; ++k) state_.value[6 * i + k] -= move[k];
    u64 visits = 0;  // the only clock: a resumed run knows no other
    for (u32 const v : state_.visits) visits += v;
    if (visits % state_.visits.size() == 0) take_out_similarity();
  }

  /// For a checkpoint.
  void save(named_arrays& to) const {
    for_each_array(state_, [&](char const* name, auto const& values) { to.set(name, values); });
  }
  ///@{
  /// The same in memory.
  pose_state const& state() const { return state_; }
  void set_state(pose_state const& s) { state_ = s; }
  ///@}
  /// From a checkpoint of as many.
  void load(named_arrays const& from) {
    pose_state taken = state_;
    for_each_array(taken, [&](char const* name, auto& values) { from.take(name, values); });
    state_ = std::move(taken);
  }

 private:
  template <class State, class F>
  static void for_each_array(State& s, F const& f) {
    f("pose", s.value), f("pose/first", s.first), f("pose/second", s.second), f("pose/visits", s.visits);
    f("pose/metric", s.metric);
  }
  int warm_up(int iterations) const {
    return std::min(500, static_cast<int>(options_.warm_up * static_cast<float>(iterations)));
  }
  pose_numbers numbers(std::size_t i) const {
    pose_numbers out;
    std::copy_n(state_.value.data() + 6 * i, 6, out.data());
    return out;
  }
  std::size_t visited() const {
    return static_cast<std::size_t>(
        std::count_if(state_.visits.begin(), state_.visits.end(), [](u32 v) { return v > 0; }));
  }

  void take_out_similarity() {
    std::size_t const n = captured_.size(), seen = visited();
    if (seen < 3) return;
    struct increment {
      vec3d arm{0.0}, shift{0.0}, turn{0.0};
    };
    std::vector<increment> all(n);
    vec3d middle(0.0), shift(0.0);
    auto const each = [&](auto const& f) {
      for (std::size_t i = 0; i < n; ++i)
        if (state_.visits[i]) f(i, all[i]);
    };
    each([&](std::size_t i, increment& at) {
      double const* const x = state_.value.data() + 6 * i;
      mat3d const axes = axes_of(captured_[i]);
      at = {captured_[i].position / extent_, axes * vec3d(x[0], x[1], x[2]), axes * vec3d(x[3], x[4], x[5])};
      middle += at.arm / static_cast<double>(seen), shift += at.shift / static_cast<double>(seen);
    });
    // Translation, scale and turn separate: arms sum to zero, and a turn moves them at right angles.
    double along = 0, square = 0;
    mat3d inertia(0.0);
    vec3d torque(0.0);
    each([&](std::size_t, increment& at) {
      at.arm -= middle;
      along += glm::dot(at.arm, at.shift), square += glm::dot(at.arm, at.arm);
      torque += glm::cross(at.arm, at.shift) + at.turn;
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
          inertia[j][i] += (i == j ? glm::dot(at.arm, at.arm) + 1 : 0) - at.arm[i] * at.arm[j];
    });
    vec3d const turn = glm::inverse(inertia) * torque;
    double const scale = square > 0 ? along / square : 0;
    each([&](std::size_t i, increment& at) {
      at.shift -= shift + glm::cross(turn, at.arm) + at.arm * scale, at.turn -= turn;
      mat3d const back = glm::transpose(axes_of(captured_[i]));
      vec3d const t = back * at.shift, w = back * at.turn;
      for (int k = 0; k < 3; ++k) {
        state_.value[6 * i + static_cast<std::size_t>(k)] = t[k];
        state_.value[6 * i + 3 + static_cast<std::size_t>(k)] = w[k];
      }
    });
  }

  pose_options options_;
  std::vector<camera> captured_;
  double extent_;
  pose_state state_;
};

}}  // namespace gart::GART_ISA
