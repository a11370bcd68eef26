#pragma once
/// \file
/// A table of a few learned numbers a row: the exposure of a view, the vignetting of a lens. A step moves one row by
/// Adam. The gradient of a row is a sum over the pixels of an image.
///
/// Buffers: 3 Floats + 1 words a row, and a few sums. Cost: a pass over the image and three launches over a few numbers
/// a step; no host read. The order of all sums depends on the image's size only. A number whose gradient is not finite
/// keeps its value.

#include <gart/algorithm/segmented_reduce.hpp>
#include <gart/core/named_arrays.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/math/arith.hpp>
#include <gart/optim/adam.hpp>

#include <string>
#include <vector>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct row_adam_kernel {
  float const* gradient;
  float* value;
  float* first;
  float* second;
  adam_rule rule;
  float rate;

  GART_KERNEL void operator()(index_t k) const {
    auto const to = rule.moved<float>({value[k], first[k], second[k]}, gradient[k], rate);
    if (!is_finite(to.second) || !is_finite(to.parameter)) return;
    value[k] = to.parameter, first[k] = to.first, second[k] = to.second;
  }
};

}  // namespace detail

/// Rows of so many floats, and Adam's moments of them.
template <execution E, int Floats>
class adam_table {
 public:
  /// [rows][Floats] to begin with. Gradients far below `epsilon` hardly move a row (adam.hpp).
  adam_table(E& exec, std::vector<float> const& start, float epsilon = adam_options::epsilon)
      : exec_(&exec),
        epsilon_(epsilon),
        value_(exec, start),
        first_(exec, std::vector<float>(start.size())),
        second_(exec, std::vector<float>(start.size())),
        visits_(start.size() / Floats),
        sums_(exec),
        gradient_(exec, Floats),
        ends_(exec, std::vector<u32>(runs + 1)) {
    std::vector<u32> ends(runs + 1);
    for (u32 r = 0; r <= runs; ++r) ends[r] = r * runs;
    ends_.assign(ends);
  }

  /// Adam's step of a row, by the last sum.
  void move(std::size_t row, float rate) {
    std::size_t const from = row * Floats;
    int const visit = static_cast<int>(++visits_[row]);
    adam_options const adam;
    adam_rule rule(adam, visit);
    rule.epsilon = epsilon_;
    parallel_for(
        *exec_, "row_adam", Floats,
        detail::row_adam_kernel{gradient_.data(), value_.data() + from, first_.data() + from, second_.data() + from,
                                rule, static_cast<float>(rate * adam_rule::first_correction(adam, visit))});
  }
  /// The same by another rank's sum, [Floats], in host memory.
  void move(std::size_t row, span<float const> gradient, float rate) {
    gradient_.assign(std::vector<float>(gradient.begin(), gradient.end()));
    move(row, rate);
  }

  /// For a checkpoint: [rows][Floats] each, and how many steps moved a row.
  void save(named_arrays& to, std::string const& name) const {
    to.set(name, value_.to_host()), to.set(name + "/first", first_.to_host());
    to.set(name + "/second", second_.to_host()), to.set(name + "/visits", visits_);
  }
  /// From a checkpoint of as many rows.
  void load(named_arrays const& from, std::string const& name) {
    std::vector<float> value(value_.size()), first(value_.size()), second(value_.size());
    from.take(name, value), from.take(name + "/first", first), from.take(name + "/second", second);
    from.take(name + "/visits", visits_);
    value_.assign(value), first_.assign(first), second_.assign(second);
  }
  /// f(row, its numbers in host memory) for each row that a step has moved.
  template <class F>
  void for_each_learned(F const& f) const {
    std::vector<float> const value = value_.to_host();
    for (std::size_t row = 0; row < visits_.size(); ++row)
      if (visits_[row]) f(row, value.data() + row * Floats);
  }

 protected:
  /// A row.
  float* at(std::size_t row) { return value_.data() + row * Floats; }

  /// Sums a row's gradient over an image: lane i of kernel.lanes writes its part to kernel.sums[Floats * i]. The sum
  /// lasts until the next call.
  template <class Kernel>
  span<float const> sum(char const* label, Kernel kernel) {
    constexpr index_t lanes = runs * runs;
    sums_.resize(std::size_t{lanes + runs} * Floats);
    auto const by_lane = sums_.view().subspan(0, std::size_t{lanes} * Floats);
    auto const by_run = sums_.view().subspan(by_lane.size(), std::size_t{runs} * Floats);
    kernel.lanes = lanes, kernel.sums = by_lane.data();
    parallel_for(*exec_, label, lanes, kernel);
    span<u32 const> const ends = ends_;
    segmented_reduce(*exec_, by_lane, Floats, ends, by_run);
    segmented_reduce(*exec_, by_run, Floats, ends.subspan(0, 2), gradient_.view());
    return gradient_;
  }

 private:
  static constexpr index_t runs = E::device ? 128 : 8;  // of as many lanes: two short sums, not a long one

  E* exec_;
  float epsilon_;
  buffer<float, E> value_, first_, second_;
  std::vector<u32> visits_;
  buffer<float, E> sums_, gradient_;
  buffer<u32, E> ends_;
};

}}  // namespace gart::GART_ISA
