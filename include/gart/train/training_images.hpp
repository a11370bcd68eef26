#pragma once
/// \file
/// The true images where kernels can read them: the dataset's own memory on host policies; on a device each is copied
/// at its first use and stays.

#include <gart/exec/buffer.hpp>
#include <gart/io/dataset.hpp>
#include <gart/loss/image_loss.hpp>

#include <vector>

namespace gart::inline GART_ISA {

/// The photographs of a dataset's training views, in a policy's memory from their first use on.
template <execution E>
class training_images {
 public:
  /// The dataset must outlive it.
  explicit training_images(dataset const& data) : data_(data), pixels_(data.train.size()), masks_(data.train.size()) {}

  /// The photograph of a training view, by its index, over that background.
  truth_view get(E& exec, std::size_t view, vec3 background) {
    dataset_view const& v = data_.train[view];
    truth_view out;
    out.channels = v.image.channels;
    out.background = background;
    out.pixels = resident(exec, v.image, pixels_[view]);
    out.mask = v.mask.empty() ? nullptr : resident(exec, v.mask, masks_[view]);
    return out;
  }

 private:
  static u8 const* resident(E& exec, image8 const& image, buffer<u8, E>& copy) {
    if constexpr (!E::device) return image.data.data();
    if (copy.size() == 0) copy = buffer<u8, E>(exec, image.data);
    return copy.data();
  }
  dataset const& data_;
  std::vector<buffer<u8, E>> pixels_, masks_;
};

}  // namespace gart::inline GART_ISA
