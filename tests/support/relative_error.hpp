#pragma once
// How far floats are from what they are to be in double, all of them as one vector.

#include <cmath>
#include <vector>

namespace gart_test {

// norm(difference) / norm(expected); infinite where a value is not finite.
inline double relative_error(std::vector<float> const& got, std::vector<double> const& expected) {
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    error += (got[i] - expected[i]) * (got[i] - expected[i]);
    norm += expected[i] * expected[i];
  }
  if (!std::isfinite(error)) return INFINITY;
  return error == 0 ? 0 : std::sqrt(error / norm);
}

}  // namespace gart_test
