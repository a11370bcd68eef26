#pragma once
/// \file
/// Poses of the training views, learned with the Gaussians. Adam moves the six numbers of the step's view
/// (pose/pose.hpp) on the host (optim/host_adam.hpp). The metric of its image scales them (pose/pose_metric.hpp). The
/// loss holds a pull to the capture's poses, with translations in units of the scene's extent.
///
/// Moving, turning and scaling the whole capture with its scene changes no image, so no loss holds the views. So once
/// an epoch the similarity nearest to their increments is removed from them,
///   minimise over v, o, s:  sum_i |a_i - v - o x r_i - s r_i|^2 / extent^2 + |b_i - o|^2,
/// a_i and b_i the increments of position and turn in world axes, r_i the position from the mean. The mean position and
/// turn are then the capture's.
///
/// A gradient that is not finite moves nothing. Cost: none that shows; memory: 440 bytes a view.

#include <gart/optim/host_adam.hpp>
#include <gart/pose/options.hpp>
#include <gart/pose/pose.hpp>
#include <gart/pose/pose_metric.hpp>

#include <algorithm>
#include <utility>

namespace gart { inline namespace GART_ISA {

/// The poses of a run.
class pose_training : public host_adam<pose_options, 6> {
 public:
  /// From the capture's cameras; `extent` is the scene's.
  pose_training(pose_options const& options, std::vector<camera> captured, double extent)
      : host_adam(options, captured.size()),
        captured_(std::move(captured)),
        extent_(extent),
        metric_(36 * captured_.size()) {}

  /// A view's learned camera.
  camera view(std::size_t i) const { return visits_[i] ? moved(captured_[i], numbers(i), extent_) : captured_[i]; }

  /// Whether view i has no metric yet.
  bool wants_metric(std::size_t i) const { return metric_[36 * i] == 0; }
  /// The metric, from depth and transmittance of an image by the view's learned camera.
  std::array<double, 36> metric_of(camera const& view, span<float const> depth, span<float const> transmittance) const {
    return pose_metric(view, depth, transmittance, extent_);
  }
  /// Sets the metric, before the view's first step.
  void set_metric(std::size_t i, std::array<double, 36> const& metric) {
    std::copy(metric.begin(), metric.end(), metric_.begin() + static_cast<std::ptrdiff_t>(36 * i));
  }

  /// Moves view i by the gradient at its pose.
  void step(std::size_t i, pose_gradient const& by, int step, int iterations) {
    pose_numbers const at = numbers(i);
    pose_numbers slope = pull_back(captured_[i], at, extent_, by);
    metric_root const metric(metric_.data() + 36 * i,
                             between(options_.damping, options_.damping_final, step, iterations));
    for (std::size_t k = 0; k < 6; ++k) slope[k] += double{options_.prior} * at[k];
    slope = metric.gradient(slope);
    for (double const x : slope)
      if (!std::isfinite(x)) return;
    pose_numbers const moves = metric.step(move(i, slope, step, iterations));
    for (std::size_t k = 0; k < 6; ++k) value_[6 * i + k] -= moves[k];
    u64 visits = 0;  // the only clock: a resumed run knows no other
    for (u32 const v : visits_) visits += v;
    if (visits % visits_.size() == 0) take_out_similarity();
  }

  /// For a checkpoint.
  void save(named_arrays& to) const { host_adam::save(to, "pose"), to.set("pose/metric", metric_); }
  /// From a checkpoint of as many.
  void load(named_arrays const& from) {
    pose_training taken = *this;
    taken.host_adam::load(from, "pose"), from.take("pose/metric", taken.metric_);
    *this = std::move(taken);
  }

 private:
  std::size_t visited() const {
    return static_cast<std::size_t>(std::count_if(visits_.begin(), visits_.end(), [](u32 v) { return v > 0; }));
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
        if (visits_[i]) f(i, all[i]);
    };
    each([&](std::size_t i, increment& at) {
      double const* const x = value_.data() + 6 * i;
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
        value_[6 * i + static_cast<std::size_t>(k)] = t[k];
        value_[6 * i + 3 + static_cast<std::size_t>(k)] = w[k];
      }
    });
  }

  std::vector<camera> captured_;
  double extent_;
  std::vector<double> metric_;  // [views][6][6] (pose/pose_metric.hpp), zeros before the first visit
};

}}  // namespace gart::GART_ISA
