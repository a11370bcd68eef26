#pragma once
// Fewer values for many: 256 numbers that stand for all, and rows that all Gaussians share.

#include <gart/core/types.hpp>

#include <array>
#include <vector>

namespace gart::io {

// 256 numbers in ascending order, closer where the values are dense. Their density is the cube root of the values',
// which gives the least squared error. Then each moves to the mean of its nearest values.
class codebook {
 public:
  explicit codebook(std::vector<float> const& values);
  // Numbers a step apart, with 0 among them, if 256 of them reach from the least to the greatest value. Else as above.
  // They compress better, since middle numbers are more frequent.
  static codebook even(std::vector<float> const& values, double step);
  u8 nearest(float value) const;
  std::array<float, 256> const& numbers() const { return numbers_; }

 private:
  std::array<float, 256> numbers_{};
};

struct palette {
  std::size_t width = 0;
  std::vector<float> rows;  // [count][width]
  std::vector<u32> of;      // each row's number among them
  double error = 0;         // of a number, squared, in the weighted mean
  std::size_t count() const { return width ? rows.size() / width : 0; }
};

// At most `count` rows near the given ones [n][width], nearer for larger weights [n]. The set with the largest squared
// error is halved at its mean, along its most varied column. So on until there are `count` sets. A few rounds of
// k-means follow. For many rows the search for the nearest mean keeps to a branch of the sets, so it takes seconds.
palette shared_rows(std::vector<float> const& rows, std::vector<float> const& weights, std::size_t width,
                    std::size_t count);

}  // namespace gart::io
