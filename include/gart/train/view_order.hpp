#pragma once
/// \file
/// The view of a step. Every training view that is not held out comes once an epoch, in an order shuffled by (seed,
/// epoch).

#include <gart/optim/random.hpp>

#include <algorithm>
#include <utility>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// The views that are trained on, by index: of `views`, those not held out.
inline std::vector<std::size_t> views_trained_on(std::size_t views, std::vector<std::size_t> const& held_out) {
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < views; ++i)
    if (std::find(held_out.begin(), held_out.end(), i) == held_out.end()) out.push_back(i);
  return out;
}

/// Which view a step trains on: all in turn, in another order each time round.
class view_order {
 public:
  /// Of `views` views, without those held out.
  view_order(std::size_t views, std::vector<std::size_t> const& held_out, u64 seed)
      : views_(views_trained_on(views, held_out)), order_(views_), seed_(seed) {}
  /// Whether no view is left.
  bool empty() const { return views_.empty(); }

  /// The view of a step.
  std::size_t at(int step) {
    int const epoch = step / static_cast<int>(order_.size());
    if (epoch != epoch_) shuffle(epoch);
    return order_[static_cast<std::size_t>(step) % order_.size()];
  }

 private:
  void shuffle(int epoch) {
    random_source const source{seed_, static_cast<u32>(epoch), random_use::user};
    order_ = views_;
    for (std::size_t i = order_.size(); i > 1; --i) {
      auto const words = source.words(i);
      std::swap(order_[i - 1], order_[below(words.v[0], words.v[1], i)]);
    }
    epoch_ = epoch;
  }

  std::vector<std::size_t> views_, order_;
  u64 seed_;
  int epoch_ = -1;
};

}}  // namespace gart::GART_ISA
