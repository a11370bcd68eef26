#pragma once
/// \file
/// What renderers ask of the arrays that they are given, before anything reads them.
/// Errors: invalid_argument, naming the array, its size and the right size.

#include <gart/core/error.hpp>
#include <gart/scene/features.hpp>
#include <gart/scene/gaussians.hpp>

#include <string>

namespace gart {

/// Arrays of a model on the host: each has as many numbers as the opacities say. `what` names the call.
inline void require_arrays(gaussian_model const& model, std::string const& what = "renderer.set_model") {
  require_count(model.size());
  for_each_array(
      [&](parameter_array const& a, auto const& values) {
        std::size_t const needed = model.size() * a.width(model.sh_degree);
        if (values.size() != needed)
          throw invalid_argument(what + ": gaussian_model." + a.name + " has " + std::to_string(values.size()) +
                                 " numbers, and " + std::to_string(model.size()) + " opacities of SH degree " +
                                 std::to_string(model.sh_degree) + " ask for " + std::to_string(needed) +
                                 ": gaussian_model::resize makes them agree");
      },
      model);
  std::size_t const needed = model.size() * static_cast<std::size_t>(model.feature_count);
  if (model.feature_count < 0 || model.feature_count > most_features || model.features.size() != needed)
    throw invalid_argument(what + ": gaussian_model.features has " + std::to_string(model.features.size()) +
                           " numbers, and " + std::to_string(model.size()) + " Gaussians of feature_count " +
                           std::to_string(model.feature_count) + ", at most " + std::to_string(most_features) +
                           ", ask for " + std::to_string(needed));
}

/// Arrays that somebody else owns: none is null. `what` names the call.
template <class T>
void require_arrays(gaussians_view<T> const& arrays, char const* what) {
  require_count(arrays.count);
  if (arrays.count == 0) return;
  for_each_array(
      [&](parameter_array const& a, T* values) {
        if (!values)
          throw invalid_argument(std::string(what) + ": gaussians_view." + a.name + " is null, and there are " +
                                 std::to_string(arrays.count) + " Gaussians: set all five arrays");
      },
      arrays);
}

}  // namespace gart
