#pragma once
/// \file
/// Features of Gaussians: N numbers each, 1 to 512, that are shown as colours are, without a direction. Their meaning
/// is the caller's: classes, embeddings, intensities. Errors: invalid_argument naming what disagrees.

#include <gart/core/error.hpp>
#include <gart/core/macros.hpp>
#include <gart/core/types.hpp>

#include <cstddef>
#include <string>
#include <type_traits>

namespace gart {

/// Features of a Gaussian, at most.
inline constexpr int most_features = 512;

/// Where they lie. T is float or float const.
template <class T>
struct feature_view {
  T* values = nullptr;  ///< [count][width]
  index_t count = 0;    ///< Gaussians
  int width = 0;        ///< N, numbers of each; 0: there are no features

  /// Numbers in all.
  std::size_t size() const { return static_cast<std::size_t>(count) * static_cast<std::size_t>(width); }
  /// The same, which can be read alone.
  GART_HD operator feature_view<T const>() const requires(!std::is_const_v<T>) { return {values, count, width}; }
};

/// Throws invalid_argument where the features are not one set for each of so many Gaussians; `call` names the caller.
template <class T>
void require_features(feature_view<T> const& features, std::size_t gaussians, std::string const& call) {
  if (features.width == 0) return;
  if (features.width < 0 || features.width > most_features)
    throw invalid_argument(call + ": feature_view.width is " + std::to_string(features.width) +
                           ": a Gaussian has 1 to " + std::to_string(most_features) + " features, or 0 for none");
  if (features.count != gaussians)
    throw invalid_argument(call + ": feature_view.count is " + std::to_string(features.count) + ", and there are " +
                           std::to_string(gaussians) + " Gaussians: give a row of features for each");
  if (!features.values && features.count > 0)
    throw invalid_argument(call + ": feature_view.values is null, and there are " + std::to_string(features.count) +
                           " Gaussians of " + std::to_string(features.width) + " features: set it");
}

}  // namespace gart
