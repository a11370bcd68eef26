#pragma once
/// \file
/// A table of learned maps of an image's colours. A row of a few numbers is the exposure of a view, or the vignetting
/// of a lens. Each maps the rendered image before the loss. The gradient of a row is a sum over the pixels of an image.
/// A step moves one row by Adam.
///
/// Rows may be centred: their mean over the rows that have moved stays where they started. What all of them share
/// is then left to the scene.
///
/// Buffers: 3 Floats + 1 words a row, a few sums, and a copy of the image. Cost: two passes over the image and four
/// launches over a few numbers a step; no host read. The order of all sums depends on the image's size only. A number
/// whose gradient is not finite keeps its value.

#include <gart/algorithm/segmented_reduce.hpp>
#include <gart/core/named_arrays.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/math/arith.hpp>
#include <gart/optim/adam.hpp>

#include <algorithm>
#include <string>
#include <vector>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct row_adam_kernel {
  float const* gradient;
  float* value;
  float* first;
  float* second;
  float* change;
  adam_rule rule;
  float rate;

  GART_KERNEL void operator()(index_t k) const {
    auto const to = rule.moved<float>({value[k], first[k], second[k]}, gradient[k], rate);
    change[k] = 0;
    if (!is_finite(to.second) || !is_finite(to.parameter)) return;
    change[k] = to.parameter - value[k];
    value[k] = to.parameter, first[k] = to.first, second[k] = to.second;
  }
};

// Takes a row's share of the last change from each number that has moved: those have a second moment.
struct centring_kernel {
  float* value;
  float const* second;
  float const* change;
  index_t floats;
  float share;

  GART_KERNEL void operator()(index_t i) const {
    if (second[i] > 0) value[i] = fma(-share, change[i % floats], value[i]);
  }
};

template <class Map>
struct map_kernel {
  Map map;
  typename Map::row const* row;
  float const* image;
  float* mapped;
  GART_KERNEL void operator()(index_t pixel) const {
    std::size_t const at = std::size_t{3} * pixel;
    map.apply(*row, pixel, image + at, mapped + at);
  }
};

// A lane takes every lanes-th pixel, turns its gradient, and sums the row's.
template <class Map>
struct map_gradient_kernel {
  Map map;
  typename Map::row const* row;
  float const* image;
  float* gradient;  // in: dL/d mapped, out: dL/d image
  index_t pixels, lanes;
  float* sums;  // [lanes][floats]

  GART_KERNEL void operator()(index_t lane) const {
    constexpr int floats = Map::row::floats;
    typename Map::row const numbers = *row;
    float sum[floats] = {};
    for (index_t pixel = lane; pixel < pixels; pixel += lanes) {
      std::size_t const at = std::size_t{3} * pixel;
      map.differentiate(numbers, pixel, image + at, gradient + at, sum);
    }
    for (int k = 0; k < floats; ++k) sums[std::size_t{floats} * lane + k] = sum[k];
  }
};

}  // namespace detail

/// Map (detail::exposure_map) has the type of a row, whether rows are centred, and Adam's epsilon: gradients far below
/// it hardly move a row (adam.hpp). For kernels it has how a row maps the colour of a pixel.
template <execution E, class Map>
class adam_table {
  static constexpr int floats = Map::row::floats;

 public:
  /// [rows][floats] to begin with.
  adam_table(E& exec, std::vector<float> const& start)
      : exec_(&exec),
        value_(exec, start),
        first_(exec, std::vector<float>(start.size())),
        second_(exec, std::vector<float>(start.size())),
        visits_(start.size() / floats),
        mapped_(exec),
        sums_(exec),
        gradient_(exec, floats),
        change_(exec, floats),
        ends_(exec, std::vector<u32>(runs + 1)) {
    std::vector<u32> ends(runs + 1);
    for (u32 r = 0; r <= runs; ++r) ends[r] = r * runs;
    ends_.assign(ends);
  }

  /// Adam's step of a row by its gradient, [floats] in host memory.
  void move(std::size_t row, span<float const> gradient, float rate) {
    gradient_.assign(std::vector<float>(gradient.begin(), gradient.end()));
    std::size_t const from = row * floats;
    int const visit = static_cast<int>(++visits_[row]);
    adam_options const adam;
    adam_rule rule(adam, visit);
    rule.epsilon = Map::epsilon;
    parallel_for(*exec_, "row_adam", floats,
                 detail::row_adam_kernel{gradient_.data(), value_.data() + from, first_.data() + from,
                                         second_.data() + from, change_.data(), rule,
                                         static_cast<float>(rate * adam_rule::first_correction(adam, visit))});
    if constexpr (Map::centred) {
      auto const moved = std::count_if(visits_.begin(), visits_.end(), [](u32 visits) { return visits > 0; });
      parallel_for(*exec_, "row_centre", static_cast<index_t>(value_.size()),
                   detail::centring_kernel{value_.data(), second_.data(), change_.data(), index_t{floats},
                                           1.0f / static_cast<float>(moved)});
    }
  }

  /// For a checkpoint: [rows][floats] each, and how many steps moved a row.
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
      if (visits_[row]) f(row, value.data() + row * floats);
  }

 protected:
  /// The image [H][W][3] mapped by a row, until the next call.
  span<float const> apply(std::size_t row, Map const& map, span<float const> image) {
    mapped_.resize(image.size());
    parallel_for(*exec_, Map::label, static_cast<index_t>(image.size() / 3),
                 detail::map_kernel<Map>{map, at(row), image.data(), mapped_.data()});
    return mapped_;
  }

  /// Turns dL/d mapped into dL/d image. The row's gradient, [floats], lasts until the next call.
  span<float const> differentiate(std::size_t row, Map const& map, span<float const> image, span<float> gradient) {
    constexpr index_t lanes = runs * runs;
    sums_.resize(std::size_t{lanes + runs} * floats);
    auto const by_lane = sums_.view().subspan(0, std::size_t{lanes} * floats);
    auto const by_run = sums_.view().subspan(by_lane.size(), std::size_t{runs} * floats);
    parallel_for(*exec_, Map::gradient_label, lanes,
                 detail::map_gradient_kernel<Map>{map, at(row), image.data(), gradient.data(),
                                                  static_cast<index_t>(image.size() / 3), lanes, by_lane.data()});
    span<u32 const> const ends = ends_;
    segmented_reduce(*exec_, by_lane, floats, ends, by_run);
    segmented_reduce(*exec_, by_run, floats, ends.subspan(0, 2), gradient_.view());
    return gradient_;
  }

 private:
  static constexpr index_t runs = E::device ? 128 : 8;  // of as many lanes: two short sums, not a long one

  typename Map::row const* at(std::size_t row) const {
    return reinterpret_cast<typename Map::row const*>(value_.data() + row * floats);
  }

  E* exec_;
  buffer<float, E> value_, first_, second_;
  std::vector<u32> visits_;
  buffer<float, E> mapped_, sums_, gradient_, change_;
  buffer<u32, E> ends_;
};

}}  // namespace gart::GART_ISA
