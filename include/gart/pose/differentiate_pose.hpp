#pragma once
/// \file
/// The gradient of a view's pose, from a backward pass's gradients of the Gaussians:
///
///   differentiate(frame, pass, color_gradient, gradients);      // backward/backward.hpp
///   pose_differentiation<E> by_pose(exec);
///   pose_gradient const g = by_pose(frame, gradients);          // or into memory of the policy
///
/// An image depends on the Gaussians relative to the camera. Moving the camera by dp moves all of them by -dp. Turning
/// it by a small w about its position p turns them by -w about p. They keep the colours that the turned rays see:
///   dL/dp = -sum_i dL/dmean_i
///   dL/dw = sum_i [ -(mean_i - p) x dL/dmean_i - torque_i + turn_i ]
/// torque_i is the gradient by a small turn of the Gaussian in the world. It is half the vector part of dL/dq q*
/// (math/quaternion.hpp). turn_i is that of its colours (math/sh_turn.hpp). No ray is traced again. It holds for every
/// method, any function of the image, and with or without the pixels' filter. It holds for any camera whose rays all
/// move with its pose.
///
/// Gaussians whose mean and first band have no gradient were not seen, and only cost their reads. Numbers that are not
/// finite are skipped. Sums over lanes are in double, in an order that depends on the number of Gaussians only. Several
/// ranks each sum their own runs (of_rows); on hosts the total has the bits of a single rank. Cost: one read of the
/// gradients, and of the parameters of seen Gaussians. That is at most 464 bytes a Gaussian of degree 3. Memory: 48
/// bytes for each of at most 1024 sums; on hosts one for 64 Gaussians.

#include <gart/core/error.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/stage.hpp>
#include <gart/math/sh_turn.hpp>
#include <gart/optim/rows.hpp>
#include <gart/pose/pose.hpp>
#include <gart/scene/parameters.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

namespace pose_kernels {

// A team takes every teams-th run of Gaussians. Their coefficients go through scratch: a row is read by neighbouring
// lanes, and used by one.
template <int Degree>
struct sum_gaussians {
  static constexpr int block_size = 128, min_blocks = 8;
  static constexpr index_t run = 64;  // Gaussians at a time
  static constexpr int row = 3 * sh_coefficients(Degree), pitch = row | 1, word = row % 4 == 0 ? 4 : 1;
  struct scratch {
    float color[run * pitch], by_color[run * pitch];
    float sum[run * pose_gradient::floats];  // a row a lane
    u32 seen[run];
  };

  gaussians_view<float const> scene, gradients;
  vec3d position;
  index_t teams;
  double* sums;  // [teams][6]

  GART_KERNEL void operator()(auto const& team) const {
    scratch& s = team.scratch();
    team.for_each(run * pose_gradient::floats, [&](index_t k) { s.sum[k] = 0; });
    team.barrier();
    for (index_t first = team.tile() * run; first < scene.count; first += teams * run) {
      index_t const count = scene.count - first < run ? scene.count - first : run;
      team.for_each(count, [&](index_t k) { s.seen[k] = is_seen(first + k); });
      team.barrier();
      if constexpr (Degree > 0) {
        team.for_each(count * (row / word), [&](index_t k) { load(s, first, k); });
        team.barrier();
      }
      team.for_each(count, [&](index_t k) { add(s, first + k, k); });
      team.barrier();
    }
    team.for_each(pose_gradient::floats, [&](index_t k) {
      double sum = 0;
      for (index_t lane = 0; lane < run; ++lane) sum += double{s.sum[pose_gradient::floats * lane + k]};
      sums[std::size_t{pose_gradient::floats} * team.tile() + k] = sum;
    });
  }

 private:
  GART_HD bool is_seen(index_t i) const {
    float const* const mean = gradients.mean + std::size_t{3} * i;
    float const* const band = gradients.sh + std::size_t{row} * i;
    return (mean[0] != 0) | (mean[1] != 0) | (mean[2] != 0) | (band[0] != 0) | (band[1] != 0) | (band[2] != 0);
  }

  GART_HD void load(scratch& s, index_t first, index_t k) const {
    index_t const lane = k / (row / word), column = k % (row / word) * word;
    if (!s.seen[lane]) return;
    std::size_t const from = std::size_t{row} * (first + lane) + column, to = std::size_t{pitch} * lane + column;
    if constexpr (word == 4) {
      quad const c = *reinterpret_cast<quad const*>(scene.sh + from);
      quad const g = *reinterpret_cast<quad const*>(gradients.sh + from);
      for (int j = 0; j < 4; ++j) s.color[to + j] = c.v[j], s.by_color[to + j] = g.v[j];
    } else {
      s.color[to] = scene.sh[from], s.by_color[to] = gradients.sh[from];
    }
  }

  GART_HD void add(scratch& s, index_t i, index_t lane) const {
    if (!s.seen[lane]) return;
    float const* const m = gradients.mean + std::size_t{3} * i;
    float const* const g = gradients.quaternion + std::size_t{4} * i;
    gaussian_parameters const p = load_parameters(scene, i);
    quaternion const& q = p.rotation;
    vec3 const by_mean(m[0], m[1], m[2]), arm = relative_mean(p.mean, position);
    vec3 turn(0.0f);
    if constexpr (Degree > 0) turn = sh_turn<Degree>(s.color + pitch * lane, s.by_color + pitch * lane);
    // The vector part of g q*.
    vec3 const torque(q.w * g[1] - g[0] * q.x - g[2] * q.z + g[3] * q.y,
                      q.w * g[2] - g[0] * q.y - g[3] * q.x + g[1] * q.z,
                      q.w * g[3] - g[0] * q.z - g[1] * q.y + g[2] * q.x);
    float const out[pose_gradient::floats] = {-by_mean.x,
                                              -by_mean.y,
                                              -by_mean.z,
                                              arm.z * by_mean.y - arm.y * by_mean.z - 0.5f * torque.x + turn.x,
                                              arm.x * by_mean.z - arm.z * by_mean.x - 0.5f * torque.y + turn.y,
                                              arm.y * by_mean.x - arm.x * by_mean.y - 0.5f * torque.z + turn.z};
    for (int k = 0; k < pose_gradient::floats; ++k)
      if (!is_finite(out[k])) return;
    for (int k = 0; k < pose_gradient::floats; ++k) s.sum[pose_gradient::floats * lane + k] += out[k];
  }
};

// One team adds the teams' sums, in their order.
struct sum_teams {
  static constexpr index_t lanes = 32;
  struct scratch {
    double sum[lanes * pose_gradient::floats];
  };
  double const* sums;
  index_t teams;
  float* out;  // [6]

  GART_KERNEL void operator()(auto const& team) const {
    scratch& s = team.scratch();
    team.for_each(lanes * pose_gradient::floats, [&](index_t k) {
      double sum = 0;
      for (std::size_t at = k; at < std::size_t{teams} * pose_gradient::floats; at += lanes * pose_gradient::floats)
        sum += sums[at];
      s.sum[k] = sum;
    });
    team.barrier();
    team.for_each(pose_gradient::floats, [&](index_t k) {
      double sum = 0;
      for (index_t lane = 0; lane < lanes; ++lane) sum += s.sum[pose_gradient::floats * lane + k];
      out[k] = static_cast<float>(sum);
    });
  }
};

}  // namespace pose_kernels

/// Computes gradients of poses, one at a time, and keeps the memory for them.
template <execution E>
class pose_differentiation {
 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit pose_differentiation(E& exec) : exec_(&exec), sums_(exec), out_(exec) {}

  /// Writes a pose_gradient's numbers in order to out, [6] in the policy's memory. `gradients` come from
  /// differentiate() for the frame's view. Errors: invalid_argument for gradients of another number of Gaussians or
  /// another degree, or a short `out`.
  template <class Frame>
  void operator()(Frame const& frame, gaussians_view<float const> gradients, span<float> out) {
    gaussians_view<float const> const scene = frame.scene();
    if (gradients.count != scene.count || gradients.sh_degree != scene.sh_degree)
      throw invalid_argument(
          "differentiate_pose: the gradients must have the number and the SH degree of the Gaussians");
    if (out.size() < pose_gradient::floats)
      throw invalid_argument("differentiate_pose: the gradient of a pose has six numbers");
    of_rows<Frame::sh_degree>(scene, gradients, frame.view().position, whole_scene<E>(), out);
  }

  /// Gaussians that are summed together.
  static constexpr index_t run = pose_kernels::sum_gaussians<0>::run;
  /// The same for the Gaussians of a scene on one or several ranks. Ranks exchange the sums of runs, in double.
  template <int Degree>
  void of_rows(gaussians_view<float const> scene, gaussians_view<float const> gradients, vec3d const& position,
               all_rows<E>& rows, span<float> out) {
    stage_scope stage(*exec_, "pose");
    index_t const runs = (scene.count + run - 1) / run;
    index_t const teams = E::device && !rows.spread() ? std::min(runs, most_teams) : runs;
    using kernel = pose_kernels::sum_gaussians<Degree>;
    sums_.resize(std::size_t{pose_gradient::floats} * teams);
    parallel_for(*exec_, "pose/sum", tile_range{teams, kernel::block_size},
                 kernel{scene, gradients, position, teams, sums_.data()});
    if (rows.spread()) sums_.assign(rows.sums_of_runs(sums_.to_host(), run, pose_gradient::floats));
    parallel_for(
        *exec_, "pose/total", tile_range{1, 192},
        pose_kernels::sum_teams{sums_.data(), static_cast<index_t>(sums_.size() / pose_gradient::floats), out.data()});
  }
  /// The policy.
  E& exec() const { return *exec_; }

  /// Returns it to the host; waits for it.
  template <class Frame>
  pose_gradient operator()(Frame const& frame, gaussians_view<float const> gradients) {
    out_.resize(pose_gradient::floats);
    (*this)(frame, gradients, out_.view());
    return pose_gradient(out_.to_host().data());
  }

 private:
  static constexpr index_t most_teams = 1024;

  E* exec_;
  buffer<double, E> sums_;
  buffer<float, E> out_;
};

/// The same for a single call.
template <class Frame>
pose_gradient differentiate_pose(Frame const& frame, gaussians_view<float const> gradients) {
  return pose_differentiation<typename Frame::execution_type>(frame.exec())(frame, gradients);
}

}}  // namespace gart::GART_ISA
