#pragma once
/// \file
/// Hit lists on the host.

#include <gart/core/types.hpp>

#include <vector>

namespace gart {

/// The hits of all rays, one ray after the other, each ray's in order. Those of ray r are [offsets[r], offsets[r + 1]).
struct hit_lists {
  std::vector<u64> offsets;   ///< [R + 1]
  std::vector<u32> ids;       ///< Gaussians
  std::vector<float> t;       ///< distances
  std::vector<float> alpha;   ///< opacities
  std::vector<float> weight;  ///< transmittance before the hit times alpha
};

}  // namespace gart
