#pragma once
/// \file
/// The error of each pixel of an image: the mean over its channels of |image - truth|, as the loss takes it
/// (loss/image_loss.hpp). Growth by error (train/densify/error_growth.hpp) attributes it to the Gaussians. image:
/// [H][W][3]; error: [H][W], resized; 0 where a mask excludes the pixel. One launch, 20 bytes a pixel.

#include <gart/loss/image_loss.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct error_map_kernel {
  float const* image;
  truth_view truth;
  float* error;
  index_t first;  // pixel
  GART_KERNEL void operator()(index_t k) const {
    index_t const pixel = first + k;
    vec3 const y = truth.color(pixel);
    float sum = 0;
    for (int c = 0; c < 3; ++c) sum += fabsf(difference_of(image[std::size_t{3} * pixel + c], y[c]));
    error[pixel] = truth.counts(pixel) ? sum * (1.0f / 3.0f) : 0.0f;
  }
};

}  // namespace detail

/// Queues the launch that fills `error`: of an image so wide, in some rows.
template <execution E>
void error_map(E& exec, span<float const> image, truth_view const& truth, buffer<float, E>& error,
               image_rows const& rows, int width) {
  error.resize(image.size() / 3);
  parallel_for(exec, "error_map", static_cast<index_t>(rows.count()) * width,
               detail::error_map_kernel{image.data(), truth, error.data(), static_cast<index_t>(rows.first) * width});
}
/// Of the whole image.
template <execution E>
void error_map(E& exec, span<float const> image, truth_view const& truth, buffer<float, E>& error) {
  error_map(exec, image, truth, error, {0, static_cast<int>(image.size() / 3)}, 1);
}

}}  // namespace gart::GART_ISA
