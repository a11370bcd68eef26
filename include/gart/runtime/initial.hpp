#pragma once
/// \file
/// Where training starts: a model from points (log-scale = ln sqrt(max(mean squared distance to the 3 nearest
/// neighbours, least_distance^2)), identity rotation, colour in the constant band, no channel under half a step of 8
/// bits, where it would have no gradient), or from points at random in a box.

#include <gart/io/dataset.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/train/options.hpp>

namespace gart {

/// `scale` is times the distance to the neighbours.
gaussian_model model_from_points(point_cloud const& points, int sh_degree, float opacity, float scale,
                                 float least_distance = 3.1622777e-4f);
/// `count` points, even over the box from lo to hi, of colours at random: the same for the same seed.
point_cloud random_points(vec3d lo, vec3d hi, index_t count, u64 seed);

/// The dataset's points, or random ones in its bounds; at most options.max_gaussians (a random subset beyond).
gaussian_model initial_model(dataset const& data, train_options const& options, int sh_degree);

/// Mean squared distance of each point to its 3 nearest others. O(n log n).
std::vector<float> neighbor_distance2(std::vector<float> const& position);

}  // namespace gart
