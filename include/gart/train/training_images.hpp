#pragma once
/// \file
/// The photographs where kernels can read them, at the size of a step's images. Host policies read the dataset's own
/// memory. On a device a photograph is copied at its first use. It stays there while all take at most a quarter of the
/// memory that was free at the start. Others are copied at each use (1 ms for 8 million pixels, hidden behind earlier
/// kernels), so thousands of large photographs fit. Masks have the weights of the cameras' pixels
/// (camera/pixel_weights.hpp) in them.

#include <gart/camera/pixel_weights.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/io/dataset.hpp>
#include <gart/loss/image_loss.hpp>
#include <gart/train/smaller_photo.hpp>

#include <vector>

namespace gart { inline namespace GART_ISA {

/// The photographs of a dataset's training views, in a policy's memory.
template <execution E>
class training_images {
 public:
  /// The dataset must outlive it.
  training_images(E& exec, dataset const& data) : training_images(exec, data, exec.free_bytes() / 4) {}
  /// With room for so many bytes of them.
  training_images(E& exec, dataset const& data, u64 room)
      : exec_(exec),
        data_(data),
        room_(room),
        pixels_(data.train.size()),
        masks_(data.train.size()),
        streamed_pixels_(exec),
        streamed_mask_(exec),
        weights_(data.train.size()),
        smaller_(exec) {}

  /// The photograph of a training view, by its index, over that background; so many times smaller. Until the next call.
  truth_view get(std::size_t view, vec3 background, int shrink) {
    dataset_view const& v = data_.train[view];
    truth_view out;
    out.channels = v.image.channels;
    out.background = background;
    out.pixels = in_memory(v.image, pixels_[view], streamed_pixels_);
    if (has_pixel_weights(v.view)) {
      image8& weights = weights_[view];
      if (masks_[view].size() == 0 && weights.empty()) weights = weighted(v);
      out.mask = in_memory(weights, masks_[view], streamed_mask_);
      if (masks_[view].size() > 0) weights = {};
    } else {
      out.mask = v.mask.empty() ? nullptr : in_memory(v.mask, masks_[view], streamed_mask_);
    }
    return smaller_.shrink(out, v.image.width, v.image.height, shrink);
  }

 private:
  u8 const* in_memory(image8 const& image, buffer<u8, E>& kept, buffer<u8, E>& streamed) {
    if constexpr (!E::device) return image.data.data();
    if (kept.size() > 0) return kept.data();
    std::size_t const bytes = image.data.size();
    if (bytes <= room_) {
      room_ -= bytes;
      kept = buffer<u8, E>(exec_, image.data);
      return kept.data();
    }
    streamed.resize(bytes);
    exec_.copy_in(streamed.data(), image.data.data(), bytes);
    return streamed.data();
  }
  static image8 weighted(dataset_view const& v) {
    image8 out = pixel_weights(v.view);
    for (std::size_t i = 0; i < v.mask.data.size(); ++i)
      if (v.mask.data[i] == 0) out.data[i] = 0;
    return out;
  }
  E& exec_;
  dataset const& data_;
  u64 room_;  // bytes that photographs may still take for good
  std::vector<buffer<u8, E>> pixels_, masks_;
  buffer<u8, E> streamed_pixels_, streamed_mask_;  // a photograph that does not stay
  std::vector<image8> weights_;
  smaller_photo<E> smaller_;
};

}}  // namespace gart::GART_ISA
