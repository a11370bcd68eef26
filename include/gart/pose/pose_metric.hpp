#pragma once
/// \file
/// How far an image moves with its camera's pose. Let a camera move by unit t and turn by w, in its own axes. A point
/// in direction d, with q one over its distance, then moves on the sphere of directions by
///   -unit q (1 - d d^T) t + d x w;
/// The metric is the 6 x 6 matrix of the mean square of this movement over the image. A shift to the side and a turn
/// after it nearly cancel. In numbers where the metric is the identity they do not. So Adam, which treats numbers one
/// by one, converges fast. CamP (Park et al. 2023) preconditions in the same way; here the image's depth gives the
/// metric. A share of the mean diagonal is added, which damps directions that the image hardly determines.
///
/// Host side, in double, over a grid of at most about 64 x 64 pixels.

#include <gart/camera/models.hpp>
#include <gart/core/span.hpp>
#include <gart/pose/pose.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

/// The metric's root, lower triangular: metric = root root^T.
class metric_root {
 public:
  static constexpr std::size_t size = 6;  ///< numbers of a pose

  /// damping: the share of the mean diagonal that is added. metric: [6][6]; of zeros every number stands for itself.
  metric_root(double const* metric, double damping) {
    double trace = 0;
    for (std::size_t i = 0; i < size; ++i) trace += metric[size * i + i];
    for (std::size_t i = 0; i < size; ++i)
      for (std::size_t j = 0; j <= i; ++j) {
        double sum = metric[size * i + j] + (i != j ? 0.0 : trace > 0 ? damping * trace / size : 1.0);
        for (std::size_t k = 0; k < j; ++k) sum -= root_[size * i + k] * root_[size * j + k];
        root_[size * i + j] = i == j ? std::sqrt(sum) : sum / root_[size * j + j];
      }
  }

  /// The gradient by numbers in which the metric is the identity, from that by a pose's.
  pose_numbers gradient(pose_numbers g) const {
    for (std::size_t i = 0; i < size; ++i) {
      for (std::size_t j = 0; j < i; ++j) g[i] -= root_[size * i + j] * g[j];
      g[i] /= root_[size * i + i];
    }
    return g;
  }
  /// A step in a pose's numbers, from one in the metric's.
  pose_numbers step(pose_numbers z) const {
    for (std::size_t i = size; i-- > 0;) {
      for (std::size_t j = i + 1; j < size; ++j) z[i] -= root_[size * j + i] * z[j];
      z[i] /= root_[size * i + i];
    }
    return z;
  }

 private:
  std::array<double, size * size> root_{};
};

/// The metric, [6][6], from depth (the sum of weight x distance) and transmittance, both [H][W].
inline std::array<double, 36> pose_metric(camera const& view, span<float const> depth, span<float const> transmittance,
                                          double unit) {
  constexpr std::size_t n = metric_root::size;
  std::array<double, n * n> h{};
  double weights = 0;
  mat3d const back = glm::transpose(axes_of(view));
  int const across = std::max(1, view.width / 64), down = std::max(1, view.height / 64);
  for (int y = down / 2; y < view.height; y += down)
    for (int x = across / 2; x < view.width; x += across) {
      std::size_t const pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width) + static_cast<std::size_t>(x);
      double const covered = 1 - double{transmittance[pixel]}, far = double{depth[pixel]};
      if (!(covered > 0.01 && far > 0)) continue;
      vec3d const d = back * vec3d(ray_direction(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
      double const nearness = unit * covered / far;
      for (int k = 0; k < 3; ++k) {
        vec3d axis(0.0);
        axis[k] = 1;
        // A row of both blocks.
        vec3d const shift = (axis - d * d[k]) * -nearness, turn = glm::cross(axis, d);
        double const row[n] = {shift.x, shift.y, shift.z, turn.x, turn.y, turn.z};
        for (std::size_t i = 0; i < n; ++i)
          for (std::size_t j = 0; j < n; ++j) h[n * i + j] += covered * row[i] * row[j];
      }
      weights += covered;
    }
  for (double& x : h) x /= weights > 0 ? weights : 1;
  return h;
}

}}  // namespace gart::GART_ISA
