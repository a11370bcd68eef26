#pragma once
/// \file
/// Some Gaussians of a model, and the Gaussians of two models in one, on the host. Cost: a copy of them.

#include <gart/scene/gaussians.hpp>

#include <algorithm>
#include <utility>
#include <vector>

namespace gart {

/// The Gaussians of these numbers, in their order.
inline gaussian_model selected(gaussian_model const& model, std::vector<u32> const& numbers) {
  gaussian_model out;
  out.feature_count = model.feature_count;
  out.resize(numbers.size(), model.sh_degree);
  for_each_row_array(
      [&](std::size_t width, std::vector<float>& to, std::vector<float> const& from) {
        for (std::size_t i = 0; i < numbers.size(); ++i)
          std::copy_n(from.data() + numbers[i] * width, width, to.data() + i * width);
      },
      model, out, model);
  return out;
}

/// Adds the Gaussians of another model, both of the higher SH degree then; features stay where both have as many.
inline void append(gaussian_model& all, gaussian_model part) {
  int const degree = std::max(all.sh_degree, part.sh_degree);
  all = with_sh_degree(std::move(all), degree), part = with_sh_degree(std::move(part), degree);
  if (all.feature_count != part.feature_count)
    for (gaussian_model* m : {&all, &part}) m->feature_count = 0, m->features.clear();
  for_each_row_array([](std::size_t, auto& to, auto const& from) { to.insert(to.end(), from.begin(), from.end()); },
                     all, all, part);
}

}  // namespace gart
