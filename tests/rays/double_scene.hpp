#pragma once
// Scenes of instances in double, by their definition.

#include <gart/instances/instance.hpp>

#include <rays/double_rays.hpp>

#include <array>
#include <cmath>
#include <vector>

namespace gart_test {

// A scene's definition: all Gaussians where they stand, colours in the axes of their instance.
inline double_model scene_of(std::vector<double_model> const& models, std::vector<gart::instance> const& instances,
                             std::vector<std::array<double, 6>> const& moved) {
  double_model out{gart::gaussian_model{}};
  out.bands = 16;
  for (std::size_t n = 0; n < instances.size(); ++n) {
    double_model const& m = models[instances[n].model];
    std::array<double, 6> const& by = moved[n];
    // A turn about the instance's position: exp([w]x) in double, by its series.
    double turn[3][3], r[3][3];
    for (int column = 0; column < 3; ++column) {
      double v[3] = {column == 0 ? 1.0 : 0.0, column == 1 ? 1.0 : 0.0, column == 2 ? 1.0 : 0.0}, sum[3] = {};
      for (int order = 1; order < 20; ++order) {
        for (int k = 0; k < 3; ++k) sum[k] += v[k];
        double const next[3] = {by[4] * v[2] - by[5] * v[1], by[5] * v[0] - by[3] * v[2], by[3] * v[1] - by[4] * v[0]};
        for (int k = 0; k < 3; ++k) v[k] = next[k] / order;
      }
      for (int k = 0; k < 3; ++k) turn[k][column] = sum[k];
    }
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        r[i][j] = 0;
        for (int k = 0; k < 3; ++k) r[i][j] += turn[i][k] * instances[n].rotation[j][k];
      }
    // The rotation's quaternion: here none of these is near half a turn.
    double const w = 0.5 * std::sqrt(1 + r[0][0] + r[1][1] + r[2][2]);
    double const q[4] = {w, (r[2][1] - r[1][2]) / (4 * w), (r[0][2] - r[2][0]) / (4 * w),
                         (r[1][0] - r[0][1]) / (4 * w)};
    for (std::size_t g = 0; g < m.count; ++g) {
      double const* const b = &m.quaternion[4 * g];
      for (std::size_t k = 0; k < 3; ++k) {
        double at = instances[n].position[static_cast<int>(k)] + by[k];
        for (std::size_t j = 0; j < 3; ++j) at += instances[n].scale * r[k][j] * m.mean[3 * g + j];
        out.mean.push_back(at);
        out.log_scale.push_back(m.log_scale[3 * g + k] + std::log(instances[n].scale));
      }
      out.quaternion.push_back(q[0] * b[0] - q[1] * b[1] - q[2] * b[2] - q[3] * b[3]);
      out.quaternion.push_back(q[0] * b[1] + q[1] * b[0] + q[2] * b[3] - q[3] * b[2]);
      out.quaternion.push_back(q[0] * b[2] - q[1] * b[3] + q[2] * b[0] + q[3] * b[1]);
      out.quaternion.push_back(q[0] * b[3] + q[1] * b[2] - q[2] * b[1] + q[3] * b[0]);
      out.opacity.push_back(m.opacity[g]);
      for (std::size_t k = 0; k < 48; ++k) out.sh.push_back(k < 3 * m.bands ? m.sh[3 * m.bands * g + k] : 0.0);
      for (std::size_t k = 0; k < 9; ++k) out.turns.push_back(r[k % 3][k / 3]);
      ++out.count;
    }
  }
  return out;
}

}  // namespace gart_test
