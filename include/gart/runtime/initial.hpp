#pragma once
/// \file
/// Where training starts: a model from points (log-scale = ln sqrt(max(mean squared distance to the 3 nearest
/// neighbours, least_distance^2)), identity rotation, colour in the constant band, no channel under half a step of 8
/// bits, where it would have no gradient), from points that depth maps measured, or from points at random in a box.

#include <gart/io/dataset.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/train/options.hpp>

namespace gart {

/// `scale` is times the distance to the neighbours.
gaussian_model model_from_points(point_cloud const& points, int sh_degree, float opacity, float scale,
                                 float least_distance = 3.1622777e-4f);
/// `count` points, even over the box from lo to hi, of colours at random: the same for the same seed.
point_cloud random_points(vec3d lo, vec3d hi, index_t count, u64 seed);

/// `count` points at most that the depth maps of the training views measured, at pixels drawn at random over all of
/// them, in the colours of the photographs; fewer where fewer have a distance, are seen and are not masked. Views in
/// `but`, by index, are left out. The same for the same seed.
point_cloud points_of_maps(dataset const& data, index_t count, u64 seed, std::vector<std::size_t> const& but = {});

/// The dataset's points, those of its depth maps, or random ones in its bounds, as choose_start has it; at most
/// options.max_gaussians (a random subset beyond).
gaussian_model initial_model(dataset const& data, train_options const& options, int sh_degree);

/// Mean squared distance of each point to its 3 nearest others. O(n log n).
std::vector<float> neighbor_distance2(std::vector<float> const& position);

}  // namespace gart
