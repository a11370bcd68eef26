#pragma once
/// \file
/// The only place that includes GLM: vectors and matrices, column-major, for host and device.

#if defined(__CUDACC__)
#include <cuda.h>  // GLM's CUDA support is an #error unless this comes first
#endif
#ifndef GLM_FORCE_XYZW_ONLY
#define GLM_FORCE_XYZW_ONLY
#endif
#include <glm/geometric.hpp>
#include <glm/mat3x3.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace gart {

using vec2 = glm::vec2;  ///< floats
using vec3 = glm::vec3;  ///< floats
using vec4 = glm::vec4;  ///< floats
/// Of three floats, or of three times a float a lane.
template <class F>
using vec3_of = glm::vec<3, F, glm::defaultp>;
using vec3d = glm::dvec3;  ///< doubles
using mat3 = glm::mat3;    ///< m[column][row]
using mat3d = glm::dmat3;  ///< doubles

}  // namespace gart
