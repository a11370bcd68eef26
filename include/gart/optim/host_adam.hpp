#pragma once
/// \file
/// Rows of a few learned numbers that Adam moves on the host, in double. A row is the pose of a view, or the lens of a
/// camera. A step moves one row. Adam counts the visits of a row, since a run has few of them.

#include <gart/core/named_arrays.hpp>
#include <gart/optim/schedule.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// Options (pose/options.hpp, lens/options.hpp) has warm_up, until, rate, rate_final, beta1 and beta2.
template <class Options, std::size_t Width>
class host_adam {
 public:
  using row = std::array<double, Width>;  ///< the numbers of a row

  /// Whether rows move in step `step` of so many.
  bool learns(int step, int iterations) const { return step >= warm_up(iterations); }

 protected:
  /// Rows of zeros.
  host_adam(Options const& options, std::size_t rows)
      : options_(options), value_(Width * rows), first_(Width * rows), second_(Width * rows), visits_(rows) {}

  /// A row's numbers.
  row numbers(std::size_t i) const {
    row out;
    std::copy_n(value_.data() + Width * i, Width, out.data());
    return out;
  }
  /// A step's value of what decays exponentially from the warm-up to options.until.
  double between(float first, float last, int step, int iterations) const {
    int const from = warm_up(iterations), until = static_cast<int>(options_.until * static_cast<float>(iterations));
    return double{exponential_decay(first, last, step - from, until - from)};
  }
  /// What Adam subtracts from row i for this gradient, which is finite. Counts a visit.
  row move(std::size_t i, row const& gradient, int step, int iterations) {
    int const visit = static_cast<int>(++visits_[i]);
    double const rate = between(options_.rate, options_.rate_final, step, iterations);
    double const beta1 = options_.beta1, beta2 = options_.beta2;
    double const first = 1 / (1 - std::pow(beta1, visit)), second = 1 / (1 - std::pow(beta2, visit));
    row moves;
    for (std::size_t k = 0; k < Width; ++k) {
      double &m = first_[Width * i + k], &v = second_[Width * i + k], g = gradient[k];
      m = beta1 * m + (1 - beta1) * g, v = beta2 * v + (1 - beta2) * g * g;
      moves[k] = rate * first * m / (std::sqrt(second * v) + 1e-15);
    }
    return moves;
  }

  /// For a checkpoint.
  void save(named_arrays& to, std::string const& name) const {
    to.set(name, value_), to.set(name + "/first", first_), to.set(name + "/second", second_);
    to.set(name + "/visits", visits_);
  }
  /// From a checkpoint of as many rows.
  void load(named_arrays const& from, std::string const& name) {
    from.take(name, value_), from.take(name + "/first", first_), from.take(name + "/second", second_);
    from.take(name + "/visits", visits_);
  }

  Options options_;                             ///< of the run
  std::vector<double> value_, first_, second_;  ///< [rows][Width], and Adam's moments
  std::vector<u32> visits_;                     ///< [rows] steps that moved the row

 private:
  int warm_up(int iterations) const {
    return std::min(500, static_cast<int>(options_.warm_up * static_cast<float>(iterations)));
  }
};

}}  // namespace gart::GART_ISA
