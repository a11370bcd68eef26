#pragma once
/// \file
/// The first Gaussians of a training, from points. These are the capture's, those matched in its photographs, those
/// that depth maps measured, or random ones in a box. Log-scale = ln sqrt(max(mean squared distance to the 3 nearest
/// neighbours, least_distance^2)); the rotation is the identity. The constant band has the colour. Each channel is at
/// least half a step of 8 bits, since a colour of 0 has no gradient.

#include <gart/io/dataset.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/train/options.hpp>

namespace gart {

/// `scale` multiplies the distance to the neighbours.
gaussian_model model_from_points(point_cloud const& points, int sh_degree, float opacity, float scale,
                                 float least_distance = 3.1622777e-4f);
/// `count` random points with random colours, uniform in the box from lo to hi: the same for the same seed.
point_cloud random_points(vec3d lo, vec3d hi, index_t count, u64 seed);

/// At most `count` points that the training views' depth maps measured, at random pixels, with the photographs'
/// colours. Masked pixels and those without a distance give none. Views in `but`, by index, are left out. The same for
/// the same seed.
point_cloud points_of_maps(dataset const& data, index_t count, u64 seed, std::vector<std::size_t> const& but = {});

/// The Gaussians that choose_start chooses. Beyond options.max_gaussians a random subset is taken.
gaussian_model initial_model(dataset const& data, train_options const& options, int sh_degree);

/// Mean squared distance of each point to its 3 nearest others. O(n log n).
std::vector<float> neighbor_distance2(std::vector<float> const& position);

}  // namespace gart
