#pragma once
// Fewer values for many: 256 numbers that stand for all, and rows that all Gaussians share.

#include <gart/core/types.hpp>

#include <array>
#include <vector>

namespace gart::io {

// 256 numbers in ascending order, close together where the values are dense: the density that leaves the least squared
// error, its cube root, then each moved to the mean of what is nearest to it.
class codebook {
 public:
  explicit codebook(std::vector<float> const& values);
  // Numbers a step apart, nought among them, where 256 of them reach from the least to the most; else as above. What is
  // written with them takes fewer bits: the numbers in the middle come up more often than those at the ends.
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

// `count` rows, or fewer, near the given ones [n][width], nearer where the weight [n] is more: the set with the largest
// squared error is halved at its mean, along the column that varies most, until there are as many sets as rows; then
// each row goes to the nearest mean and the means follow, a few times. Where there are many of both, "the nearest" is
// that of a branch of the sets, so that it takes seconds.
palette shared_rows(std::vector<float> const& rows, std::vector<float> const& weights, std::size_t width,
                    std::size_t count);

}  // namespace gart::io
