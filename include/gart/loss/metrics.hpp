#pragma once
/// \file
/// How good a render is, against the truth: PSNR and SSIM as papers report them. In double, on the host's cores.
/// Renders are clamped to [0, 1] first. Straight alpha of a photograph is composited on the background. Pixels that a
/// mask excludes count in neither sum of PSNR. For SSIM, whose windows need them, they are set to the truth. Errors:
/// invalid_argument where the sizes differ or an image is empty.

#include <gart/core/error.hpp>
#include <gart/loss/ssim_window.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/image.hpp>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace gart { inline namespace GART_ISA {

namespace detail {

inline void check_pair(image_float const& render, image_float const& truth, char const* metric) {
  auto const shape = [](image_float const& i) {
    return std::to_string(i.width) + "x" + std::to_string(i.height) + "x" + std::to_string(i.channels);
  };
  if (render.empty() || render.width != truth.width || render.height != truth.height ||
      render.channels != truth.channels || render.data.size() != truth.data.size())
    throw invalid_argument(std::string(metric) + ": render is " + shape(render) + ", truth is " + shape(truth) +
                           "; both must have the same size, and pixels");
}

// A NaN becomes 0, so that one does not hide how wrong the rest is.
inline double clamped(float v) { return v > 0 ? (v < 1 ? v : 1.0) : 0.0; }

}  // namespace detail

/// The truth that a view is held against.
inline image_float composited(image8 const& image, vec3 background) {
  image_float result(image.width, image.height, 3);
  std::size_t const pixels = static_cast<std::size_t>(image.width) * image.height;
  for (std::size_t p = 0; p < pixels; ++p) {
    u8 const* const from = image.data.data() + p * image.channels;
    float const alpha = image.channels == 4 ? from[3] / 255.0f : 1.0f;
    for (int c = 0; c < 3; ++c) {
      float const value = from[image.channels >= 3 ? c : 0] / 255.0f;
      result.data[3 * p + c] = value * alpha + background[c] * (1 - alpha);
    }
  }
  return result;
}

/// Makes excluded pixels equal to the truth; the share of pixels that count. An empty mask excludes none.
inline double apply_mask(image8 const& mask, image_float const& truth, image_float& render) {
  if (mask.empty()) return 1;
  detail::check_pair(render, truth, "mask");
  std::size_t const pixels = static_cast<std::size_t>(truth.width) * truth.height;
  std::size_t kept = 0;
  for (std::size_t p = 0; p < pixels; ++p) {
    if (mask.data[p * mask.channels] != 0) {
      ++kept;
      continue;
    }
    for (int c = 0; c < 3; ++c) render.data[3 * p + c] = truth.data[3 * p + c];
  }
  return static_cast<double>(kept) / static_cast<double>(pixels);
}

/// -10 log10 of the mean squared error; infinite where the images are equal.
inline double psnr(image_float const& render, image_float const& truth) {
  detail::check_pair(render, truth, "psnr");
  std::size_t const row_size = static_cast<std::size_t>(truth.width) * truth.channels;
  std::vector<double> rows(truth.height);
#if defined(_OPENMP)
#pragma omp parallel for
#endif
  for (int y = 0; y < truth.height; ++y) {
    double sum = 0;
    for (std::size_t i = y * row_size; i < (y + 1) * row_size; ++i) {
      double const d = detail::clamped(render.data[i]) - truth.data[i];
      sum += d * d;
    }
    rows[y] = sum;
  }
  double sum = 0;
  for (double const row : rows) sum += row;
  return sum > 0 ? -10 * std::log10(sum / static_cast<double>(truth.data.size()))
                 : std::numeric_limits<double>::infinity();
}

/// For a render whose excluded pixels equal the truth; `share` is that of the counted pixels. The mean square over all
/// pixels is `share` times the mean over the counted ones.
inline double masked_psnr(image_float const& render, image_float const& truth, double share) {
  return psnr(render, truth) + 10 * std::log10(share);
}

/// Mean over pixels and channels; 1 where the images are equal.
inline double ssim(image_float const& render, image_float const& truth) {
  detail::check_pair(render, truth, "ssim");
  int const w = truth.width, h = truth.height, channels = truth.channels;
  std::vector<double> rows(h);
  // Windowed sums along rows of x, y, xx, yy, xy: [5][H][W], a channel at a time.
  std::size_t const plane = static_cast<std::size_t>(w) * h;
  std::vector<double> along(5 * plane);
  for (int c = 0; c < channels; ++c) {
#if defined(_OPENMP)
#pragma omp parallel for
#endif
    for (int y = 0; y < h; ++y)
      for (int x = 0; x < w; ++x) {
        double sums[5] = {};
        for (int k = 0; k < ssim_window::taps; ++k) {
          int const at = x + k - ssim_window::radius;
          if (at < 0 || at >= w) continue;
          double const weight = ssim_window::weight(k);
          double const a = detail::clamped(render.at(at, y, c)), b = truth.at(at, y, c);
          sums[0] += weight * a, sums[1] += weight * b;
          sums[2] += weight * a * a, sums[3] += weight * b * b, sums[4] += weight * a * b;
        }
        for (int p = 0; p < 5; ++p) along[p * plane + static_cast<std::size_t>(y) * w + x] = sums[p];
      }
#if defined(_OPENMP)
#pragma omp parallel for
#endif
    for (int y = 0; y < h; ++y) {
      double row = 0;
      for (int x = 0; x < w; ++x) {
        double s[5] = {};
        for (int k = 0; k < ssim_window::taps; ++k) {
          int const at = y + k - ssim_window::radius;
          if (at < 0 || at >= h) continue;
          for (int p = 0; p < 5; ++p)
            s[p] += ssim_window::weight(k) * along[p * plane + static_cast<std::size_t>(at) * w + x];
        }
        double const luminance = (2 * s[0] * s[1] + ssim_window::c1) / (s[0] * s[0] + s[1] * s[1] + ssim_window::c1);
        double const structure =
            (2 * (s[4] - s[0] * s[1]) + ssim_window::c2) / (s[2] - s[0] * s[0] + s[3] - s[1] * s[1] + ssim_window::c2);
        row += luminance * structure;
      }
      rows[y] += row;
    }
  }
  double sum = 0;
  for (double const row : rows) sum += row;
  return sum / (static_cast<double>(plane) * channels);
}

}}  // namespace gart::GART_ISA
