#pragma once
/// \file
/// Images in host memory, row-major, channels interleaved: pixel (x, y), channel c at (y * width + x) * channels + c.

#include <gart/core/types.hpp>
#include <gart/scene/pixels.hpp>

namespace gart {

/// An image of T.
template <class T>
struct basic_image {
  int width = 0, height = 0, channels = 3;  ///< pixels; channels of each
  pixels<T> data;                           ///< [height][width][channels]

  ///@{
  /// Of this size, with this value everywhere.
  basic_image() = default;
  basic_image(int w, int h, int c, T value = T{})
      : width(w), height(h), channels(c), data(static_cast<std::size_t>(w) * h * c, value) {}
  ///@}
  ///@{
  /// Channel c of pixel (x, y).
  T& at(int x, int y, int c) { return data[(static_cast<std::size_t>(y) * width + x) * channels + c]; }
  T const& at(int x, int y, int c) const { return data[(static_cast<std::size_t>(y) * width + x) * channels + c]; }
  ///@}
  /// Whether it has no pixel.
  bool empty() const { return data.empty(); }
};

using image8 = basic_image<u8>;          ///< as files hold it: 8 bits, 0..255
using image_float = basic_image<float>;  ///< [0, 1]

}  // namespace gart
