#pragma once
/// \file
/// Densification: which Gaussians a training adds, moves and removes. A densifier is a class on densifier<E>; what it
/// does not override, it does not do, and the base itself changes nothing. Those of the library are listed in
/// densifiers.hpp, and a program gives its own to trainer::densify_by. In the order of a step:
///   1. observe: once for each view of the step, with that view's gradients; or error_sums, which the backward pass
///   adds.
///   2. penalty: adds to the gradients, before the optimizer.
///   3. step: after the optimizer; it may change the Gaussians, their moments and their number.
/// All is called on all ranks alike. What a step draws must depend on the seed and the step only, or be in the state.

#include <gart/core/named_arrays.hpp>
#include <gart/io/dataset.hpp>
#include <gart/math/hit_gradient.hpp>
#include <gart/optim/schedule.hpp>
#include <gart/optim/trained_gaussians.hpp>
#include <gart/train/options.hpp>

namespace gart { inline namespace GART_ISA {

/// When a run densifies.
struct density_schedule {
  int from = 0, every = 0;  ///< steps: after the first so many, and from one to the next; 0: never
  float until = 1;          ///< share of the run
};

/// What a densifier of a run is made from.
struct density_setup {
  train_options const& options;  ///< of the run
  dataset const& data;           ///< its capture
  index_t start;                 ///< Gaussians that the run starts with
  int kernel_degree;             ///< of their response
};

/// What a step tells a densifier.
template <execution E>
struct density_step {
  int step = 0;                          ///< steps done, this one included; of a batch each image counts
  float mean_rate = 0;                   ///< Adam's of the means
  all_rows<E>& rows = whole_scene<E>();  ///< where the Gaussians are
  span<float const> filter = {};         ///< as opacity_shown has it, where the step densifies
};

/// One that changes nothing.
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
  /// Whether it looks at the errors seen through the Gaussians.
  virtual bool by_error() const { return false; }
  /// Where the backward passes add these up, [n] for the rows of this rank.
  virtual span<float> error_sums(index_t /*n*/) { return {}; }
  /// Whether it looks at the gradients of each view.
  virtual bool by_gradient() const { return false; }
  /// These, and the camera of the step's image.
  virtual void observe(gaussians<E> const& /*model*/, gaussians<E> const& /*gradients*/, camera const& /*view*/) {}
  /// Before the optimizer: adds to the gradients. `total`: Gaussians of all ranks.
  virtual void penalty(trained_gaussians<E>&, index_t /*total*/) {}
  /// After the optimizer.
  virtual density_change step(trained_gaussians<E>&, density_step<E> const&) { return {}; }
  /// What the next step depends on. Arrays of one 4-byte number a Gaussian are named as of_gaussians says.
  virtual void save(named_arrays&) const {}
  virtual void load(named_arrays const&) {}  ///< from a state
  /// From the next step on the schedules are those of a run of so many steps.
  virtual void set_iterations(int iterations) { iterations_ = iterations; }
  /// Steps are counted in images, of which each has so many.
  void set_batch(int images) { batch_ = images; }

 protected:
  /// Whether the schedule is not over.
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

/// The errors of one of a step's views, from the moments that its backward pass left ([N][moment_stride]).
template <execution E>
void add_errors(E& exec, span<float const> moments, span<float> sums) {
  parallel_for(exec, "error_sum", static_cast<index_t>(sums.size()),
               detail::error_sum_kernel{moments.data(), sums.data()});
}

}}  // namespace gart::GART_ISA
