#pragma once
// The error of each pixel of an image, the mean over its channels of |image - truth|: what growth by error
// (optim/error_growth.hpp) attributes to the Gaussians. image: [H][W][3]; error: [H][W], resized; 0 where a mask
// excludes the pixel. One launch, 20 bytes a pixel.

#include <gart/loss/image_loss.hpp>

namespace gart::inline GART_ISA {

namespace detail {

struct color_sums_kernel {
  float const* image;
  truth_view truth;
  index_t pixels, lanes;
  float* sums;  // [3][5]
  GART_HD void operator()(index_t lane) const {
    float s[15] = {};
    for (index_t p = lane; p < pixels; p += lanes) {
      vec3 const y = truth.color(p);
      for (int c = 0; c < 3; ++c) {
        float const x = image[std::size_t{3} * p + c];
        s[5 * c] += x, s[5 * c + 1] += y[c], s[5 * c + 2] += x * x, s[5 * c + 3] += x * y[c], s[5 * c + 4] += 1;
      }
    }
#ifdef __CUDA_ARCH__
    for (int k = 0; k < 15; ++k) atomicAdd(sums + k, s[k]);
#else
    for (int k = 0; k < 15; ++k)
#pragma omp atomic
      sums[k] += s[k];
#endif
  }
};

struct affine_error_kernel {
  float const* image;
  truth_view truth;
  float const* sums;
  float* error;
  int gain;
  GART_HD void operator()(index_t pixel) const {
    vec3 const y = truth.color(pixel);
    float sum = 0;
    for (int c = 0; c < 3; ++c) {
      float const* s = sums + 5 * c;
      float const n = s[4], mx = s[0] / n, my = s[1] / n, v = s[2] / n - mx * mx, cov = s[3] / n - mx * my;
      float const a = gain ? (v > 1e-6f ? cov / v : 1.0f) : 1.0f;
      sum += fabsf(a * (image[std::size_t{3} * pixel + c] - mx) + my - y[c]);
    }
    error[pixel] = sum * (1.0f / 3.0f);
  }
};

struct error_map_kernel {
  float const* image;
  truth_view truth;
  float* error;
  GART_HD void operator()(index_t pixel) const {
    vec3 const y = truth.color(pixel);
    float sum = 0;
    for (int c = 0; c < 3; ++c) sum += fabsf(image[std::size_t{3} * pixel + c] - y[c]);
    error[pixel] = truth.counts(pixel) ? sum * (1.0f / 3.0f) : 0.0f;
  }
};

}  // namespace detail

template <execution E>
void affine_error_map(E& exec, span<float const> image, truth_view const& truth, buffer<float, E>& error,
                      buffer<float, E>& sums, int gain) {
  error.resize(image.size() / 3);
  sums.resize(15);
  sums.zero();
  index_t const n = static_cast<index_t>(error.size()), lanes = n < 8192 ? n : 8192;
  parallel_for(exec, "color_sums", lanes, detail::color_sums_kernel{image.data(), truth, n, lanes, sums.data()});
  parallel_for(exec, "affine_error", n,
               detail::affine_error_kernel{image.data(), truth, sums.data(), error.data(), gain});
}

template <execution E>
void error_map(E& exec, span<float const> image, truth_view const& truth, buffer<float, E>& error) {
  error.resize(image.size() / 3);
  parallel_for(exec, "error_map", static_cast<index_t>(error.size()),
               detail::error_map_kernel{image.data(), truth, error.data()});
}

}  // namespace gart::inline GART_ISA
