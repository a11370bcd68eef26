#pragma once
/// \file
/// Lenses of the capture's cameras (lens/lens_training.hpp) as a part of a training.

#include <gart/lens/differentiate_lens.hpp>
#include <gart/lens/lens_training.hpp>
#include <gart/train/learned/part.hpp>
#include <gart/train/options.hpp>

namespace gart { inline namespace GART_ISA {

/// Where options.refine_lens asks for them.
template <class Frame>
class learned_lenses final : public learned_part<Frame> {
  using E = typename Frame::execution_type;

 public:
  /// Errors: invalid_argument with a filter of the pixels; as lens_training.
  learned_lenses(E& exec, train_options const& options, dataset const& data)
      : training_(options.lens, training_cameras(data)), differentiate_(exec) {
    if (options.render.antialias > 0)
      throw invalid_argument(
          "train_options.refine_lens: the filter of the pixels has no gradient by the focal length; set "
          "render_options.antialias to 0");
  }

  std::size_t numbers() const override { return lens_gradient::floats; }
  part_needs needs(std::size_t, int step, int iterations) const override {
    return {.image = training_.learns(step, iterations)};
  }
  bool moves_cameras() const override { return true; }
  camera view(std::size_t, camera const& as_known) const override { return training_.view(as_known); }
  camera through(camera const& as_known) const override { return training_.view(as_known); }
  void after_backward(Frame* frame, step_view const& v, span<float> numbers) override {
    if (!training_.learns(v.step, v.iterations)) return;
    if (!frame) return differentiate_.of_others(v.color.size() / 3, numbers, v.share);
    depth_image more;
    if (!v.by_image.depth.empty()) more.depth = v.depth.depth.data(), more.transmittance = v.depth.transmittance.data();
    differentiate_(*frame, v.color, v.by_image, numbers, more, v.share);
  }
  void step(std::size_t view, int shrink, span<float const> numbers, int step, int iterations,
            learning_rates const&) override {
    if (training_.learns(step, iterations))
      training_.step(view, lens_gradient(numbers.data(), shrink), step, iterations);
  }
  void save(named_arrays& state) const override { training_.save(state); }
  void load(named_arrays const& state) override { training_.load(state); }

 private:
  lens_training training_;
  lens_differentiation<E> differentiate_;
};

}}  // namespace gart::GART_ISA
