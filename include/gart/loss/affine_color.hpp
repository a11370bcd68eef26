#pragma once
/// \file
/// The PSNR that a render would have after the affine map of colours that brings it nearest to its photograph,
///   minimise over M (3 x 3) and b:  sum over pixels |M render + b - truth|^2,
/// in double on the host's cores. A diagnostic, not a score: it looks at the photograph that it is compared with. It
/// says how much of an error is one of exposure and white balance. Renders and mapped colours are clamped to [0, 1], as
/// for PSNR. So it is never below the PSNR of the same render (the map may be the identity). Pixels that a mask
/// excludes (0) do not count. Three channels. Errors: invalid_argument where the sizes differ or an image is empty.

#include <gart/loss/metrics.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// The map: matrix and offset, of colours in [0, 1].
struct affine_color {
  std::array<std::array<double, 3>, 3> matrix{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  ///< [to][from]
  std::array<double, 3> offset{};                                                  ///< [to]
};

namespace detail {

// sum(p, accumulator) over the pixels that count, rows in parallel, in the same order whatever the number of cores.
template <int N, class Sum>
std::array<double, N> sum_pixels(image_float const& truth, image8 const& mask, Sum const& sum) {
  std::vector<std::array<double, N>> rows(static_cast<std::size_t>(truth.height));
#if defined(_OPENMP)
#pragma omp parallel for
#endif
  for (int y = 0; y < truth.height; ++y) {
    std::array<double, N> row{};
    for (int x = 0; x < truth.width; ++x) {
      std::size_t const p =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(truth.width) + static_cast<std::size_t>(x);
      if (mask.empty() || mask.data[p * static_cast<std::size_t>(mask.channels)] != 0) sum(3 * p, row);
    }
    rows[static_cast<std::size_t>(y)] = row;
  }
  std::array<double, N> all{};
  for (auto const& row : rows)
    for (std::size_t k = 0; k < N; ++k) all[k] += row[k];
  return all;
}

inline void check_colors(image_float const& render, image_float const& truth, image8 const& mask) {
  check_pair(render, truth, "affine colour");
  if (truth.channels != 3) throw invalid_argument("affine colour: the images must have 3 channels");
  if (!mask.empty() && (mask.width != truth.width || mask.height != truth.height))
    throw invalid_argument("affine colour: the mask must have the size of the images");
}

}  // namespace detail

/// Colours that the render does not vary in, a grey image's for one, leave M open: there it is zero.
inline affine_color fit_affine_color(image_float const& render, image_float const& truth, image8 const& mask = {}) {
  detail::check_colors(render, truth, mask);
  // Means first, so that the remainders are small.
  auto const sums = detail::sum_pixels<7>(truth, mask, [&](std::size_t at, auto& row) {
    for (std::size_t c = 0; c < 3; ++c)
      row[c] += detail::clamped(render.data[at + c]), row[3 + c] += static_cast<double>(truth.data[at + c]);
    row[6] += 1;
  });
  affine_color fit;
  if (!(sums[6] > 0)) return fit;
  auto const mean = [&](std::size_t k) { return sums[k] / sums[6]; };
  // The 3 x 6 of [covariance of the render | covariance of render and truth].
  auto const products = detail::sum_pixels<18>(truth, mask, [&](std::size_t at, auto& row) {
    for (std::size_t i = 0; i < 3; ++i) {
      double const a = detail::clamped(render.data[at + i]) - mean(i);
      for (std::size_t j = 0; j < 3; ++j) {
        row[6 * i + j] += a * (detail::clamped(render.data[at + j]) - mean(j));
        row[6 * i + 3 + j] += a * (static_cast<double>(truth.data[at + j]) - mean(3 + j));
      }
    }
  });
  std::array<std::array<double, 6>, 3> a{};
  for (std::size_t i = 0; i < 18; ++i) a[i / 6][i % 6] = products[i];
  // Gauss-Jordan with the largest pivot of the diagonal, which serves a matrix without negative eigenvalues. A
  // remainder below rounding is no direction.
  double const least = 1e-12 * (a[0][0] + a[1][1] + a[2][2]);
  std::array<bool, 3> used{};
  for (int round = 0; round < 3; ++round) {
    std::size_t p = 3;
    for (std::size_t k = 0; k < 3; ++k)
      if (!used[k] && (p == 3 || a[k][k] > a[p][p])) p = k;
    if (!(a[p][p] > least)) break;
    used[p] = true;
    double const pivot = a[p][p];
    for (double& v : a[p]) v /= pivot;
    for (std::size_t r = 0; r < 3; ++r) {
      double const factor = a[r][p];
      if (r == p || factor == 0) continue;
      for (std::size_t c = 0; c < 6; ++c) a[r][c] -= factor * a[p][c];
    }
  }
  for (std::size_t to = 0; to < 3; ++to) {
    fit.offset[to] = mean(3 + to);
    for (std::size_t from = 0; from < 3; ++from) {
      fit.matrix[to][from] = used[from] ? a[from][3 + to] : 0;
      fit.offset[to] -= fit.matrix[to][from] * mean(from);
    }
  }
  return fit;
}

/// dB; infinite where nothing is left of the error.
inline double psnr_affine_color(image_float const& render, image_float const& truth, image8 const& mask = {}) {
  affine_color const fit = fit_affine_color(render, truth, mask);
  auto const sums = detail::sum_pixels<2>(truth, mask, [&](std::size_t at, auto& row) {
    for (std::size_t to = 0; to < 3; ++to) {
      double value = fit.offset[to];
      for (std::size_t from = 0; from < 3; ++from)
        value += fit.matrix[to][from] * detail::clamped(render.data[at + from]);
      double const d = std::clamp(value, 0.0, 1.0) - static_cast<double>(truth.data[at + to]);
      row[0] += d * d;
    }
    row[1] += 3;
  });
  return sums[0] > 0 ? -10 * std::log10(sums[0] / sums[1]) : std::numeric_limits<double>::infinity();
}

}}  // namespace gart::GART_ISA
