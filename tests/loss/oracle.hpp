#pragma once
// The loss in double by its definition: windows as 2-D sums, SSIM in its textbook form.

#include <cmath>
#include <vector>

namespace gart_test {

struct loss_value {
  double l1 = 0, ssim = 0, mse = 0;
  double total(double w) const { return (1 - w) * l1 + w * (1 - ssim); }
};

// x and y are [h][w][3].
inline loss_value naive_loss(std::vector<double> const& x, std::vector<double> const& y, int w, int h) {
  double window[11][11], sum = 0;
  for (int i = 0; i < 11; ++i)
    for (int j = 0; j < 11; ++j)
      sum += window[i][j] = std::exp(-((i - 5) * (i - 5) + (j - 5) * (j - 5)) / (2 * 1.5 * 1.5));
  loss_value out;
  for (int c = 0; c < 3; ++c)
    for (int row = 0; row < h; ++row)
      for (int column = 0; column < w; ++column) {
        double mx = 0, my = 0, xx = 0, yy = 0, xy = 0;
        for (int i = -5; i <= 5; ++i)
          for (int j = -5; j <= 5; ++j) {
            if (row + i < 0 || row + i >= h || column + j < 0 || column + j >= w) continue;
            double const g = window[i + 5][j + 5] / sum;
            double const a = x[((row + i) * w + column + j) * 3 + c], b = y[((row + i) * w + column + j) * 3 + c];
            mx += g * a, my += g * b, xx += g * a * a, yy += g * b * b, xy += g * a * b;
          }
        out.ssim += (2 * mx * my + 1e-4) * (2 * (xy - mx * my) + 9e-4) /
                    ((mx * mx + my * my + 1e-4) * (xx - mx * mx + yy - my * my + 9e-4));
        double const d = x[(row * w + column) * 3 + c] - y[(row * w + column) * 3 + c];
        out.l1 += std::abs(d), out.mse += d * d;
      }
  double const n = 3.0 * w * h;
  out.l1 /= n, out.ssim /= n, out.mse /= n;
  return out;
}

}  // namespace gart_test
