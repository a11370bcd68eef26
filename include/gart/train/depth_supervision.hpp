#pragma once
/// \file
/// What a training run needs to go by depth besides colour (loss/depth_loss.hpp): the images of depth and
/// transmittance, the gradients by them, and the maps of the capture where kernels read them. Of a strategy without
/// depth there is nothing of it.

#include <gart/backward/backward.hpp>
#include <gart/io/dataset.hpp>
#include <gart/loss/depth_loss.hpp>
#include <gart/train/smaller_photo.hpp>

#include <vector>

namespace gart::inline GART_ISA {

/// The depth of a run's images. Memory: 16 bytes a pixel of an image, and on a device 4 a pixel of each view that was
/// seen.
template <execution E>
class depth_supervision {
 public:
  /// weight: of the loss, over the scene's extent; 0: no gradient but one of the caller's own.
  depth_supervision(E& exec, dataset const& data, float weight)
      : exec_(&exec),
        data_(&data),
        scale_(weight / data.extent),
        loss_(exec),
        depth_(exec),
        transmittance_(exec),
        by_depth_(exec),
        by_transmittance_(exec),
        value_(exec, 1),
        maps_(data.train.size()),
        smaller_(exec) {}

  /// Adds the targets of an image of so many pixels, the gradients by which are zero.
  void begin(image_targets& targets, std::size_t pixels) {
    depth_.resize(pixels), transmittance_.resize(pixels), by_depth_.resize(pixels), by_transmittance_.resize(pixels);
    by_depth_.zero(), by_transmittance_.zero(), value_.zero();
    targets.depth = depth_.data(), targets.transmittance = transmittance_.data();
  }
  /// The loss of the image of a training view that has a map, so many times smaller than it.
  void evaluate(std::size_t view, truth_view const& truth, int shrink) {
    image_float const& map = data_->train[view].depth;
    if (scale_ == 0 || map.empty()) return;
    float const* const distance = smaller_.shrink(resident(view, map), map.width, map.height, shrink);
    loss_.evaluate(pixels(), distance, truth, scale_, value_);
  }
  /// Images and gradients, of a loss of one's own to read and add to.
  depth_pixels pixels() { return {depth_, transmittance_, by_depth_, by_transmittance_}; }
  /// With the gradient of the colour.
  image_gradients gradients(span<float const> color) const { return {color, by_depth_, by_transmittance_}; }
  ///@{
  /// Of the image of the step, [H][W], in host memory.
  std::vector<float> depth() const { return depth_.to_host(); }
  std::vector<float> transmittance() const { return transmittance_.to_host(); }
  ///@}
  /// The loss of the step.
  float value() const { return value_.to_host()[0]; }

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
  buffer<float, E> depth_, transmittance_, by_depth_, by_transmittance_, value_;
  std::vector<buffer<float, E>> maps_;
  smaller_photo<E> smaller_;
};

/// In its place where the strategy has no depth.
struct no_depth_supervision {
  /// Throws invalid_argument where a weight asks for it.
  template <class E>
  no_depth_supervision(E&, dataset const&, float weight) {
    if (weight > 0)
      throw invalid_argument(
          "train_options.depth_weight needs gradients of depth: set configuration_request.depth, or train by "
          "with_depth<strategy>");
  }
};

}  // namespace gart::inline GART_ISA
