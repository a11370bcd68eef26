#pragma once
/// \file
/// A scene turned, scaled and moved: p -> scale R p + translation. So are means, scales, rotations and the colours that
/// depend on direction. Its image from a camera moved alike is the same one. Other maps (a reflection, another scale an
/// axis) make no Gaussians of Gaussians' parameters, or no colours, and are refused.
///
/// Errors: invalid_argument for a matrix that is none of these.

#include <gart/core/error.hpp>
#include <gart/math/glm.hpp>
#include <gart/math/sh_rotation.hpp>
#include <gart/scene/gaussians.hpp>

#include <array>
#include <cmath>

namespace gart { inline namespace GART_ISA {

/// p -> scale rotation p + translation.
struct similarity {
  mat3d rotation{1.0};     ///< orthonormal, no reflection
  double scale = 1;        ///< more than 0
  vec3d translation{0.0};  ///< world units

  /// Of a point.
  GART_HD vec3d operator()(vec3d const& p) const { return scale * (rotation * p) + translation; }
};

/// First b, then a.
inline similarity operator*(similarity const& a, similarity const& b) {
  return {a.rotation * b.rotation, a.scale * b.scale, a(b.translation)};
}

/// The rotation by a quaternion w, x, y, z of any norm but 0.
inline mat3d rotation_of(std::array<double, 4> const& q) {
  auto const [w, x, y, z] = q;
  double const s = 2 / (w * w + x * x + y * y + z * z);
  mat3d r;
  r[0] = vec3d(1 - s * (y * y + z * z), s * (x * y + w * z), s * (x * z - w * y));
  r[1] = vec3d(s * (x * y - w * z), 1 - s * (x * x + z * z), s * (y * z + w * x));
  r[2] = vec3d(s * (x * z + w * y), s * (y * z - w * x), 1 - s * (x * x + y * y));
  return r;
}

/// A unit quaternion w, x, y, z of a rotation: its largest component from the diagonal, the others by that.
inline std::array<double, 4> quaternion_of(mat3d const& r) {
  double const squares[4] = {1 + r[0][0] + r[1][1] + r[2][2], 1 + r[0][0] - r[1][1] - r[2][2],
                             1 - r[0][0] + r[1][1] - r[2][2], 1 - r[0][0] - r[1][1] + r[2][2]};
  int largest = 0;
  for (int k = 1; k < 4; ++k)
    if (squares[k] > squares[largest]) largest = k;
  double const twice = std::sqrt(squares[largest]), s = 0.5 / twice;
  std::array<double, 4> const by_each[4] = {
      {twice / 2, s * (r[1][2] - r[2][1]), s * (r[2][0] - r[0][2]), s * (r[0][1] - r[1][0])},
      {s * (r[1][2] - r[2][1]), twice / 2, s * (r[0][1] + r[1][0]), s * (r[2][0] + r[0][2])},
      {s * (r[2][0] - r[0][2]), s * (r[0][1] + r[1][0]), twice / 2, s * (r[1][2] + r[2][1])},
      {s * (r[0][1] - r[1][0]), s * (r[2][0] + r[0][2]), s * (r[1][2] + r[2][1]), twice / 2}};
  return by_each[largest];
}

/// Whether it is one, to 1e-4: orthonormal, without reflection, and finite.
inline bool is_rotation(mat3d const& r) {
  bool sound = glm::dot(glm::cross(r[0], r[1]), r[2]) > 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) sound = sound && std::abs(glm::dot(r[i], r[j]) - (i == j ? 1.0 : 0.0)) < 1e-4;
  return sound;
}

/// The similarity of a matrix given row by row, its last row 0 0 0 1.
inline similarity similarity_of(std::array<double, 16> const& m) {
  similarity s;
  mat3d a;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) a[column][row] = m[static_cast<std::size_t>(4 * row + column)];
    s.translation[row] = m[static_cast<std::size_t>(4 * row + 3)];
  }
  double const volume = glm::dot(glm::cross(a[0], a[1]), a[2]);
  s.scale = std::cbrt(volume);
  bool sound = volume > 0 && std::isfinite(volume) && m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1;
  sound = sound && is_rotation(a / s.scale);
  if (!sound)
    throw invalid_argument(
        "the matrix is no rotation, scale and translation: its columns must be of one length and "
        "at right angles, without reflection, and its last row 0 0 0 1");
  s.rotation = rotation_of(quaternion_of(a / s.scale));
  return s;
}

/// What a similarity does to Gaussians, one at a time, on any policy: kernels hold one by value.
class gaussian_mover {
 public:
  /// Of a similarity.
  explicit gaussian_mover(similarity const& by)
      : by_(by),
        turn_(by.rotation),
        log_scale_(static_cast<float>(std::log(by.scale))),
        turns_(by.rotation != mat3d(1.0)) {
    std::array<double, 4> const q = quaternion_of(by.rotation);
    for (std::size_t k = 0; k < 4; ++k) q_[k] = q[k];
  }

  /// Turns, scales and moves Gaussian i where it stands.
  GART_HD void move(gaussians_view<float> const& g, index_t i) const {
    float *const mean = g.mean + std::size_t{3} * i, *const log_scale = g.log_scale + std::size_t{3} * i;
    vec3d const p = by_(vec3d(mean[0], mean[1], mean[2]));
    for (int k = 0; k < 3; ++k) mean[k] = static_cast<float>(p[k]), log_scale[k] += log_scale_;
    if (!turns_) return;  // bits stay
    multiply({q_[0], q_[1], q_[2], q_[3]}, g.quaternion + std::size_t{4} * i);
    turn_.apply(row_of(g, i), g.sh_degree);
  }
  /// From the gradient by moved Gaussian i to that by Gaussian i, where it stands.
  GART_HD void pull_back(gaussians_view<float> const& g, index_t i) const {
    float* const mean = g.mean + std::size_t{3} * i;
    vec3d const by_mean = by_.scale * (vec3d(mean[0], mean[1], mean[2]) * by_.rotation);
    for (int k = 0; k < 3; ++k) mean[k] = static_cast<float>(by_mean[k]);
    if (!turns_) return;
    multiply({q_[0], -q_[1], -q_[2], -q_[3]}, g.quaternion + std::size_t{4} * i);
    turn_.apply_back(row_of(g, i), g.sh_degree);
  }

 private:
  struct quaternion_of_doubles {
    double w, x, y, z;
  };
  // b becomes a b.
  GART_HD static void multiply(quaternion_of_doubles const& a, float* b) {
    double const w = b[0], x = b[1], y = b[2], z = b[3];
    b[0] = static_cast<float>(a.w * w - a.x * x - a.y * y - a.z * z);
    b[1] = static_cast<float>(a.w * x + a.x * w + a.y * z - a.z * y);
    b[2] = static_cast<float>(a.w * y - a.x * z + a.y * w + a.z * x);
    b[3] = static_cast<float>(a.w * z + a.x * y - a.y * x + a.z * w);
  }
  GART_HD static float* row_of(gaussians_view<float> const& g, index_t i) {
    return g.sh + static_cast<std::size_t>(g.sh_stride()) * i;
  }

  similarity by_;
  sh_rotation turn_;
  double q_[4];
  float log_scale_;
  bool turns_;
};

/// Turns, scales and moves the Gaussians.
inline void apply(similarity const& s, gaussian_model& model) {
  gaussian_mover const by(s);
  gaussians_view<float> const all{model.mean.data(),    model.log_scale.data(), model.quaternion.data(),
                                  model.opacity.data(), model.sh.data(),        static_cast<index_t>(model.size()),
                                  model.sh_degree};
  for (index_t i = 0; i < all.count; ++i) by.move(all, i);
}

}}  // namespace gart::GART_ISA
