#pragma once
/// \file
/// The true images where kernels can read them: the dataset's own memory on host policies; on a device each is copied
/// at its first use and stays. Masks have the weights of the cameras' pixels (camera/pixel_weights.hpp) in them.

#include <gart/camera/pixel_weights.hpp>
#include <gart/camera/shutter.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/io/dataset.hpp>
#include <gart/io/image_file.hpp>
#include <gart/loss/image_loss.hpp>

#include <algorithm>
#include <map>
#include <memory>
#include <vector>

namespace gart::inline GART_ISA {

/// The photographs of a dataset's training views, in a policy's memory from their first use on.
template <execution E>
class training_images {
 public:
  /// The dataset must outlive it.
  explicit training_images(dataset const& data)
      : data_(data), pixels_(data.train.size()), masks_(data.train.size()), weights_(data.train.size()) {}

  /// The photograph of a training view, by its index, over that background; `shrink`: made smaller by this factor.
  truth_view get(E& exec, std::size_t view, vec3 background, int shrink = 1) {
    if (shrink > 1) return smaller_.try_emplace(shrink, data_, shrink).first->second.get(exec, view, background);
    dataset_view const& v = data_.train[view];
    truth_view out;
    out.channels = v.image.channels;
    out.background = background;
    out.pixels = resident(exec, v.image, pixels_[view]);
    if (has_pixel_weights(v.view)) {
      image8& weights = weights_[view];
      if (masks_[view].size() == 0 && weights.empty()) weights = weighted(v);
      out.mask = resident(exec, weights, masks_[view]);
      if constexpr (E::device) weights = {};
    } else {
      out.mask = v.mask.empty() ? nullptr : resident(exec, v.mask, masks_[view]);
    }
    return out;
  }

  /// Gives back the memory of those that were made smaller.
  void forget_smaller() { smaller_.clear(); }

 private:
  // Copies of the views, each made at its first use.
  struct smaller {
    smaller(dataset const& whole, int f) : of(whole), factor(f) {
      data.train.resize(of.train.size());
      images = std::make_unique<training_images>(data);
    }
    truth_view get(E& exec, std::size_t view, vec3 background) {
      dataset_view& v = data.train[view];
      dataset_view const& from = of.train[view];
      if (v.image.empty()) {
        v.view = shrunk(from.view, factor), v.image = box_downscale(from.image, factor);
        if (!from.mask.empty()) v.mask = counted(from.mask, v.view);
      }
      return images->get(exec, view, background);
    }
    // A pixel of which a part is excluded is.
    image8 counted(image8 const& mask, camera const& c) const {
      image8 out(c.width, c.height, 1, 255);
      for (int y = 0; y < c.height * factor; ++y)
        for (int x = 0; x < c.width * factor; ++x) {
          u8& least = out.at(x / factor, y / factor, 0);
          least = std::min(least, mask.at(x, y, 0));
        }
      return out;
    }
    dataset const& of;
    int factor;
    dataset data;
    std::unique_ptr<training_images> images;
  };

  static u8 const* resident(E& exec, image8 const& image, buffer<u8, E>& copy) {
    if constexpr (!E::device) return image.data.data();
    if (copy.size() == 0) copy = buffer<u8, E>(exec, image.data);
    return copy.data();
  }
  static image8 weighted(dataset_view const& v) {
    image8 out = pixel_weights(v.view);
    for (std::size_t i = 0; i < v.mask.data.size(); ++i)
      if (v.mask.data[i] == 0) out.data[i] = 0;
    return out;
  }
  dataset const& data_;
  std::vector<buffer<u8, E>> pixels_, masks_;
  std::vector<image8> weights_;
  std::map<int, smaller> smaller_;  // by factor
};

}  // namespace gart::inline GART_ISA
