#pragma once
/// \file
/// Falloffs of the capture's lenses (exposure/vignetting_training.hpp) as a part of a training.

#include <gart/exposure/vignetting_training.hpp>
#include <gart/train/learned/part.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

/// Where options.vignetting asks for them.
template <class Frame>
class learned_vignetting final : public learned_part<Frame> {
  using E = typename Frame::execution_type;

 public:
  /// Errors: as vignetting_training.
  learned_vignetting(E& exec, dataset const& data) : exec_(&exec), training_(exec, training_cameras(data)) {}

  std::size_t numbers() const override { return vignetting::floats; }
  part_needs needs(std::size_t, int, int) const override { return {.image = true}; }
  span<float const> before_loss(step_view const& v, span<float const> image, span<float>) override {
    return training_.shade(v.index, v.captured, image_ = image);
  }
  void after_loss(step_view const& v, span<float> gradient, span<float> numbers) override {
    exec_->copy(numbers.data(), training_.differentiate(v.index, v.captured, image_, gradient).data(),
                sizeof(vignetting));
  }
  void step(std::size_t view, int, span<float const> numbers, int, int, learning_rates const& rates) override {
    training_.move_lens_of(view, numbers, rates.vignetting);
  }
  void save(named_arrays& state) const override { training_.save(state, "vignetting"); }
  void load(named_arrays const& state) override { training_.load(state, "vignetting"); }
  void tell(learned_colors& to) const override {
    training_.for_each_learned([&](std::size_t i, float const* value) {
      vignetting v;
      std::copy_n(value, vignetting::floats, v.k);
      to.falloffs.emplace_back(training_.lenses()[i], v);
    });
  }

 private:
  E* exec_;
  vignetting_training<E> training_;
  span<float const> image_;  // before it was shaded
};

}}  // namespace gart::GART_ISA
