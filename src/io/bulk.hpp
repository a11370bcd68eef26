#pragma once
// Where most of some numbers are. Bits, boxes and codebooks are made for these: one extreme would take them all.

#include <gart/core/types.hpp>
#include <gart/math/glm.hpp>
#include <gart/scene/gaussians.hpp>

#include <algorithm>
#include <utility>
#include <vector>

namespace gart::io {

inline constexpr double most_of_all = 0.99;

// The value that a share q of the others are below, which are put in another order.
template <class T>
T quantile(std::vector<T>& values, double q) {
  auto const at = values.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

// The median, and the distance from it that all but a hundredth of the numbers keep.
struct spread {
  double middle = 0, half = 0;
};
spread spread_of(std::vector<float> values);

// From the least to the greatest of the numbers, where neither is farther from the middle than `reach` halves.
std::pair<float, float> bulk_range(std::vector<float> const& values, double reach);

// The same of the Gaussians' means, by the largest of three distances.
struct bulk {
  vec3d middle{0.0};
  double half = 0;
  std::vector<u32> strays;  // farther than far_reach halves
};
inline constexpr double far_reach = 256;
bulk bulk_of(gaussian_model const& model);

// Moves strays along the line to the middle, to the distance of `reach` halves. As much smaller, they look the same
// from there. Returns their number.
std::size_t draw_in_strays(gaussian_model& model, double reach);

}  // namespace gart::io
