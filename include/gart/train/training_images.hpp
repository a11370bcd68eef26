#pragma once
// The true images where kernels can read them: the dataset's own memory on host policies; on a device each is copied at
// its first use and stays.

#include <gart/exec/buffer.hpp>
#include <gart/io/dataset.hpp>
#include <gart/loss/image_loss.hpp>

#include <map>
#include <vector>

namespace gart {

template <execution E>
class training_images {
 public:
  explicit training_images(dataset const& data) : data_(data), pixels_(data.train.size()), masks_(data.train.size()) {}


  truth_view get(E& exec, std::size_t view, vec3 background, int level = 1) {
    dataset_view const& v = data_.train[view];
    truth_view out;
    out.channels = v.image.channels;
    out.background = background;
    if (level > 1) {
      auto& at = small_[level];
      if (at.empty()) at.resize(data_.train.size());
      if (at[view].host.empty()) at[view].host = shrink(v.image, level);
      out.pixels = resident(exec, at[view].host, at[view].copy);
      return out;
    }
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
  static image8 shrink(image8 const& in, int f) {
    image8 out(in.width / f, in.height / f, in.channels);
    for (int y = 0; y < out.height; ++y)
      for (int x = 0; x < out.width; ++x)
        for (int c = 0; c < in.channels; ++c) {
          int sum = 0, total = 0;
          for (int j = 0; j < f; ++j)
            for (int i = 0; i < f; ++i) {
              int const w = in.channels == 4 && c < 3 ? in.at(x * f + i, y * f + j, 3) : 1;
              sum += w * in.at(x * f + i, y * f + j, c), total += w;
            }
          out.at(x, y, c) = static_cast<u8>(total ? (2 * sum + total) / (2 * total) : 0);
        }
    return out;
  }
  struct small_image {
    image8 host;
    buffer<u8, E> copy;
  };
  std::map<int, std::vector<small_image>> small_;
  dataset const& data_;
  std::vector<buffer<u8, E>> pixels_, masks_;
};

}  // namespace gart
