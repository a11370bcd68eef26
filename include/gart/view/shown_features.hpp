#pragma once
/// \file
/// Which numbers stand for the features of Gaussians in a view. They are one of them or three, or the first three
/// principal directions of all. Each goes from 0 to 1 between its 1st and its 99th hundredth over the Gaussians. So
/// colours do not change as a camera moves.
///
/// Directions are eigenvectors of the covariance of an even sample of the Gaussians, by orthogonal iteration in double.
/// The largest entry of each is positive. Cost: at most 2e8 products for the covariance, and a pass over the features.
/// Errors: invalid_argument where there are no features, or none of that number.

#include <gart/scene/features.hpp>

#include <utility>
#include <vector>

namespace gart {

/// Of a model.
struct shown_features {
  int count = 0;              ///< 1 or 3
  std::vector<float> values;  ///< [N][count], from 0 to 1 but for the outer hundredths; 0.5 where all are the same
  /// The features' values at 0 and 1; of a direction, along it.
  std::vector<std::pair<float, float>> ranges;
};

/// `wanted`: the places of one or three, or empty for principal directions. One feature has no direction but itself.
shown_features features_to_show(feature_view<float const> const& features, std::vector<int> const& wanted);

/// The first three principal directions, [3][width]; zero where there are less.
std::vector<double> principal_directions(feature_view<float const> const& features);

}  // namespace gart
