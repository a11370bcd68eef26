#pragma once
// Models in a policy's memory, as scenes of instances and actors take them.

#include <gart/scene/gaussians.hpp>

#include <vector>

namespace gart_test {

template <class E>
struct placed_models {
  std::vector<gart::gaussians<E>> memory;
  placed_models(E& exec, std::vector<gart::gaussian_model> const& models) {
    for (auto const& m : models) memory.emplace_back(exec, m);
  }
  std::vector<gart::gaussians_view<float const>> views() const {
    std::vector<gart::gaussians_view<float const>> out;
    for (auto const& m : memory) out.push_back(m.view());
    return out;
  }
};

}  // namespace gart_test
