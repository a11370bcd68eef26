#pragma once
/// \file
/// Known mirrors of a capture (dataset.mirrors) as a part of a training. Pixels that meet a mirror first are traced by
/// the rays that it throws back. Their gradients go to the Gaussians in the mirror. Nothing is learned of the mirror.
/// These pixels have no filter of antialiasing. Cost: a batch of rays of those pixels, a bounce each.

#include <gart/core/isa.hpp>
#include <gart/light/mirror_service.hpp>
#include <gart/train/learned/part.hpp>

namespace gart { inline namespace GART_ISA {

/// The mirrors of a run's images.
template <class Frame>
class learned_mirrors final : public learned_part<Frame> {
  using E = typename Frame::execution_type;

 public:
  /// Errors: invalid_argument where Gaussians are on several ranks, or steps have several views.
  learned_mirrors(E& exec, dataset const& data, bool spread) : exec_(&exec), shown_(exec), by_(exec) {
    if (spread)
      throw invalid_argument(
          "dataset.mirrors: a capture with mirrors is trained on one rank, one view a step: set train_options.batch to "
          "1, or leave the mirrors out");
    mirrors_ = make_mirrors(E::name, E::device ? "" : instruction_set, Frame::response::degree, &exec, data.mirrors);
  }

  part_needs needs(std::size_t, int, int) const override { return {.image = true}; }
  span<float const> before_loss(step_view const& v, span<float const> image, span<float>) override {
    shown_.resize(image.size());
    exec_->copy(shown_.data(), image.data(), image.size() * sizeof(float));
    show(v.seen, v.options, v.model, v.degree, shown_);
    return shown_;
  }
  void after_loss(step_view const&, span<float> gradient, span<float>) override {
    by_.resize(gradient.size());
    exec_->copy(by_.data(), gradient.data(), gradient.size() * sizeof(float));
    mirrors_->take_out(gradient);
  }
  void leave_out(span<float> error) override { mirrors_->take_out(error); }
  void after_backward(Frame*, step_view const& v, span<float>) override { mirrors_->backward(by_, v.gradients); }
  bool shows() const override { return true; }
  void show(camera const& view, render_options options, gaussians_view<float const> model, int degree,
            span<float> image) override {
    options.antialias = 0;
    mirrors_->show(model, degree, view, options, image.data());
  }

 private:
  E* exec_;
  std::unique_ptr<mirror_service> mirrors_;
  buffer<float, E> shown_, by_;
};

}}  // namespace gart::GART_ISA
