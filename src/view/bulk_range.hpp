#pragma once
// The values between which all but a hundredth on either side lie.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

namespace gart::view {

// `otherwise` where there is none that is finite.
inline std::pair<float, float> bulk_range(std::vector<float> values, std::pair<float, float> otherwise) {
  std::erase_if(values, [](float v) { return !std::isfinite(v); });
  if (values.empty()) return otherwise;
  auto const at = [&](std::size_t hundredth) {
    auto const place = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * hundredth / 100);
    std::nth_element(values.begin(), place, values.end());
    return *place;
  };
  float const low = at(1);
  return {low, at(99)};
}

}  // namespace gart::view
