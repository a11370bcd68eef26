#pragma once
/// \file
/// The library's version; CMakeLists.txt reads it from here.

///@{
/// The version's numbers.
#define GART_VERSION_MAJOR 0
#define GART_VERSION_MINOR 1
#define GART_VERSION_PATCH 0
///@}

/// Training and rendering of ray-traced 3D Gaussians; `detail` is not for users.
namespace gart {

/// The version, as text.
inline constexpr char version[] = "0.1.0";

}  // namespace gart
