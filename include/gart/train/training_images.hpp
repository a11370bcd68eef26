#pragma once
/// \file
/// The true images where kernels can read them, at the size of a step's images: the dataset's own memory on host
/// policies; on a device each is copied at its first use and stays. Masks have the weights of the cameras' pixels
/// (camera/pixel_weights.hpp) in them.

#include <gart/camera/pixel_weights.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/io/dataset.hpp>
#include <gart/loss/image_loss.hpp>
#include <gart/train/smaller_photo.hpp>

#include <vector>

namespace gart { inline namespace GART_ISA {

/// The photographs of a dataset's training views, in a policy's memory from their first use on.
template <execution E>
class training_images {
 public:
  /// The dataset must outlive it.
  training_images(E& exec, dataset const& data)
      : exec_(exec),
        data_(data),
        pixels_(data.train.size()),
        masks_(data.train.size()),
        weights_(data.train.size()),
        smaller_(exec) {}

  /// The photograph of a training view, by its index, over that background; so many times smaller, until the next call.
  truth_view get(std::size_t view, vec3 background, int shrink) {
    dataset_view const& v = data_.train[view];
    truth_view out;
    out.channels = v.image.channels;
    out.background = background;
    out.pixels = resident(v.image, pixels_[view]);
    if (has_pixel_weights(v.view)) {
      image8& weights = weights_[view];
      if (masks_[view].size() == 0 && weights.empty()) weights = weighted(v);
      out.mask = resident(weights, masks_[view]);
      if constexpr (E::device) weights = {};
    } else {
      out.mask = v.mask.empty() ? nullptr : resident(v.mask, masks_[view]);
    }
    return smaller_.shrink(out, v.image.width, v.image.height, shrink);
  }

 private:
  u8 const* resident(image8 const& image, buffer<u8, E>& copy) {
    if constexpr (!E::device) return image.data.data();
    if (copy.size() == 0) copy = buffer<u8, E>(exec_, image.data);
    return copy.data();
  }
  static image8 weighted(dataset_view const& v) {
    image8 out = pixel_weights(v.view);
    for (std::size_t i = 0; i < v.mask.data.size(); ++i)
      if (v.mask.data[i] == 0) out.data[i] = 0;
    return out;
  }
  E& exec_;
  dataset const& data_;
  std::vector<buffer<u8, E>> pixels_, masks_;
  std::vector<image8> weights_;
  smaller_photo<E> smaller_;
};

}}  // namespace gart::GART_ISA
