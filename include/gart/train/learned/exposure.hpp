#pragma once
/// \file
/// Exposures of the training views (exposure/exposure_training.hpp) as a part of a training.

#include <gart/exposure/exposure_training.hpp>
#include <gart/train/learned/part.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

/// Where options.exposure asks for them.
template <class Frame>
class learned_exposures final : public learned_part<Frame> {
  using E = typename Frame::execution_type;

 public:
  /// The dataset must outlive it.
  learned_exposures(E& exec, dataset const& data) : exec_(&exec), data_(&data), training_(exec, data.train.size()) {}

  std::size_t numbers() const override { return exposure::floats; }
  part_needs needs(std::size_t, int, int) const override { return {.image = true}; }
  span<float const> before_loss(step_view const& v, span<float const> image, span<float>) override {
    return training_.expose(v.index, image_ = image);
  }
  void after_loss(step_view const& v, span<float> gradient, span<float> numbers) override {
    exec_->copy(numbers.data(), training_.differentiate(v.index, image_, gradient).data(), sizeof(exposure));
  }
  void step(std::size_t view, int, span<float const> numbers, int step, int iterations,
            learning_rates const& rates) override {
    if (static_cast<float>(step) < rates.exposure_rest * static_cast<float>(iterations)) return;
    training_.move(view, numbers, rates.exposure);
  }
  void save(named_arrays& state) const override { training_.save(state, "exposure"); }
  void load(named_arrays const& state) override { training_.load(state, "exposure"); }
  void tell(learned_colors& to) const override {
    training_.for_each_learned([&](std::size_t i, float const* value) {
      dataset_view const& v = data_->train[i];
      to.views.push_back({v.name, v.view.position, v.view.rotation[2], {}});
      std::copy_n(value, exposure::floats, to.views.back().value.m);
    });
  }

 private:
  E* exec_;
  dataset const* data_;
  exposure_training<E> training_;
  span<float const> image_;  // before it was exposed
};

}}  // namespace gart::GART_ISA
