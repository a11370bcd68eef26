#pragma once
/// \file
/// The size of a scene, as its cameras tell it: what lengths of training and meshing are shares of.

#include <gart/math/glm.hpp>

#include <vector>

namespace gart {

/// 1.1 times the largest distance of a camera's position from their mean; 0 where they have none.
double camera_extent(std::vector<vec3d> const& positions);

}  // namespace gart
