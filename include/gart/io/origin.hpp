#pragma once
/// \file
/// The origin of coordinates. Survey coordinates (UTM, geocentric) are millions of units from zero, where a float's
/// steps are coarser than visible detail. Such a capture is held from an origin among its cameras: places less the
/// origin, in double, then floats. A model keeps its capture's origin as the trait "origin", three numbers; one without
/// it is from zero. Cameras and exposures in files have the capture's own coordinates.
///
/// Errors: io_error naming the file, for a trait that is no origin.

#include <gart/io/splat_file.hpp>
#include <gart/math/glm.hpp>

#include <string>
#include <vector>

namespace gart {

/// The origin for some places. It is zero where floats resolve a hundred-thousandth of their spread. Else it is their
/// median, rounded to a power of ten within the spread. Of 100 places 99 lie within the spread of the median. If it is
/// zero, that of `others` counts, and else 1. O(places).
vec3d origin_for(std::vector<vec3d> const& places, std::vector<double> const& others = {});

/// Of a model by its traits; `file` is what errors name.
vec3d origin_of(splat_traits const& traits, std::string const& file);
/// The traits of a model from that origin; none of zero.
splat_traits with_origin(splat_traits traits, vec3d const& origin);
/// "500000,4000000,100": every digit, as origin_of reads it.
std::string to_text(vec3d const& origin);

/// The Gaussians from another origin, where they stay. In double, then floats.
void move_origin(gaussian_model& model, vec3d const& from, vec3d const& to);

}  // namespace gart
