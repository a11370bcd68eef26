#pragma once
/// \file
/// Densification: which Gaussians a training adds, moves and removes. A densifier derives from densifier<E>, whose
/// members do nothing, and overrides those that it needs. densifiers.hpp lists those of the library; a program gives
/// its own to trainer::densify_by. In the order of a step:
///   1. observe: once for each view of the step, with that view's gradients; or error_sums, which the backward pass
///   adds.
///   2. penalty: adds to the gradients, before the optimizer.
///   3. step: after the optimizer; it may change the Gaussians, their moments and their number.
/// All ranks make the same calls. Random draws must depend on the seed, the step and the state alone.

#include <gart/core/named_arrays.hpp>
#include <gart/io/dataset.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/optim/schedule.hpp>
#include <gart/optim/trained_gaussians.hpp>
#include <gart/train/options.hpp>

namespace gart { inline namespace GART_ISA {

/// When a run densifies.
struct density_schedule {
  int from = 0, every = 0;  ///< steps before the first densification, and between two; every = 0: never
  float until = 1;          ///< share of the run
};

/// The inputs for making a run's densifier.
struct density_setup {
  train_options const& options;  ///< of the run
  dataset const& data;           ///< the capture
  index_t start;                 ///< Gaussians that the run starts with
  int kernel_degree;             ///< of their response
};

/// A densifier's input in each step.
template <execution E>
struct density_step {
  int step = 0;                          ///< steps done, with this one; each image of a batch counts
  float mean_rate = 0;                   ///< Adam's rate of the means
  all_rows<E>& rows = whole_scene<E>();  ///< the rows on all ranks
  span<float const> filter = {};         ///< the filter for opacity_shown, in steps that densify
};

/// The Gaussians that a densification starts from.
template <execution E>
struct density_rows {
  all_rows<E>& rows;  ///< the rows on all ranks
  index_t here, all;  ///< Gaussians here, and on all ranks
  row_owners owners;  ///< which rank has which
};
/// Those of a step.
template <execution E>
density_rows<E> rows_of(trained_gaussians<E> const& g, density_step<E> const& now) {
  index_t const here = g.size();
  return {now.rows, here, now.rows.total(here), now.rows.owners()};
}

/// The base: changes nothing.
template <execution E>
class densifier {
 public:
  densifier() = default;
  /// For a run of so many steps.
  densifier(density_schedule const& schedule, int iterations) : iterations_(iterations), schedule_(schedule) {}
  virtual ~densifier() = default;

  /// Whether the step densifies; steps count from 1.
  virtual bool due(int step) const {
    return step > schedule_.from && is_multiple(step, schedule_.every, batch_) && running(step);
  }
  /// Whether it needs the error seen through each Gaussian.
  virtual bool by_error() const { return false; }
  /// The sums of the error, [n] for this rank's rows; backward passes add to them.
  virtual span<float> error_sums(index_t /*n*/) { return {}; }
  /// Whether it needs the gradients of each view.
  virtual bool by_gradient() const { return false; }
  /// Takes one view's gradients, and the camera of its image.
  virtual void observe(gaussians<E> const& /*model*/, gaussians<E> const& /*gradients*/, camera const& /*view*/) {}
  /// Before the optimizer: adds to the gradients. `total`: Gaussians of all ranks.
  virtual void penalty(trained_gaussians<E>&, index_t /*total*/) {}
  /// After the optimizer.
  virtual density_change step(trained_gaussians<E>&, density_step<E> const&) { return {}; }
  /// The state for the next step. of_gaussians (train/state.hpp) has the names for arrays of one 4-byte number a
  /// Gaussian.
  virtual void save(named_arrays&) const {}
  virtual void load(named_arrays const&) {}  ///< from a state
  /// Sets the run's length for schedules from the next step on.
  virtual void set_iterations(int iterations) { iterations_ = iterations; }
  /// Sets the images of a step; schedules count images.
  void set_batch(int images) { batch_ = images; }

 protected:
  /// Whether the schedule goes on.
  bool running(int step) const { return static_cast<float>(step) < schedule_.until * static_cast<float>(iterations_); }
  int iterations_ = 0;  ///< of the run
  int batch_ = 1;       ///< images a step

 private:
  density_schedule schedule_;
};

namespace detail {

struct error_sum_kernel {
  float const* moments;
  float* sum;
  GART_KERNEL void operator()(index_t i) const { sum[i] += moments[std::size_t{moment_stride} * i + error_place]; }
};

}  // namespace detail

/// Adds one view's errors, from the moments of its backward pass ([N][moment_stride]), to the sums.
template <execution E>
void add_errors(E& exec, span<float const> moments, span<float> sums) {
  parallel_for(exec, "error_sum", static_cast<index_t>(sums.size()),
               detail::error_sum_kernel{moments.data(), sums.data()});
}

}}  // namespace gart::GART_ISA
