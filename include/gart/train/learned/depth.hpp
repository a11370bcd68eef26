#pragma once
/// \file
/// Training by depth maps besides colour (loss/depth_loss.hpp) as a part of a training: of a method with_depth. Its
/// gradients by depth and transmittance stand beside those of the colours; a caller's loss may add to them. Memory: on
/// a device 4 bytes a pixel of each view that was seen.

#include <gart/io/dataset.hpp>
#include <gart/train/learned/part.hpp>
#include <gart/train/options.hpp>
#include <gart/train/smaller_photo.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

/// Errors: invalid_argument where a weight needs a gradient that the method lacks, or maps that the dataset lacks.
template <bool Depth>
void require_depth(train_options const& options, dataset const& data) {
  if (!(options.depth_weight > 0)) return;
  bool const mapped = std::any_of(data.train.begin(), data.train.end(), [](auto const& v) { return !v.depth.empty(); });
  if (!Depth)
    throw invalid_argument(
        "train_options.depth_weight needs gradients of depth: set configuration_request.depth, or train by "
        "with_depth<method>");
  if (!mapped)
    throw invalid_argument("train_options.depth_weight: no training view has a depth map (dataset_options.depth)");
}

/// The depth of a run's images.
template <class Frame>
class learned_depth final : public learned_part<Frame> {
  using E = typename Frame::execution_type;

 public:
  /// weight: the loss's, over the scene's extent; 0: only the caller's loss gives gradients.
  learned_depth(E& exec, dataset const& data, float weight)
      : exec_(&exec),
        data_(&data),
        scale_(weight / data.extent),
        loss_(exec),
        maps_(data.train.size()),
        smaller_(exec) {}

  std::size_t numbers() const override { return 1; }
  part_needs needs(std::size_t, int, int) const override { return {.depth = true}; }
  span<float const> before_loss(step_view const& v, span<float const> image, span<float> numbers) override {
    image_float const& map = data_->train[v.index].depth;
    if (scale_ == 0 || map.empty()) return image;
    float const* const distance = smaller_.shrink(resident(v.index, map), map.width, map.height, v.shrink);
    loss_.evaluate(v.depth, distance, v.truth, scale_, numbers);
    return image;
  }
  float loss(span<float const> numbers) const override { return numbers.data()[0]; }

 private:
  float const* resident(std::size_t view, image_float const& map) {
    if constexpr (!E::device) return map.data.data();
    buffer<float, E>& copy = maps_[view];
    if (copy.size() == 0) copy = buffer<float, E>(*exec_, map.data);
    return copy.data();
  }

  E* exec_;
  dataset const* data_;
  float scale_;
  depth_loss<E> loss_;
  std::vector<buffer<float, E>> maps_;
  smaller_photo<E> smaller_;
};

}}  // namespace gart::GART_ISA
