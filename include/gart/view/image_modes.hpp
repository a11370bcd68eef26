#pragma once
/// \file
/// Images of a scene besides its colours: distances, normals, opacity, hits, the difference to a photograph. Also the
/// colour maps that show them. Host memory, a few passes over the pixels each.

#include <gart/render/rendered.hpp>
#include <gart/scene/camera.hpp>
#include <gart/view/scene.hpp>

#include <utility>

namespace gart {

/// The mean distance of what each pixel sees, along its ray; 0 where it sees less than half.
image_float mean_distances(rendered const& r);

/// Normals of the distances' surface, in the world's axes, towards the camera: [H][W][3]. Zero where a pixel, or both
/// of its neighbours in a direction, have no distance.
image_float normals_of(image_float const& distances, camera const& view);
/// Normals as colours, (n + 1) / 2, black where there is none: [H][W][3] in [0, 1].
image_float normal_colors(image_float normals);

image_float alpha_of(rendered const& r);  ///< how much of each pixel's ray is stopped
image_float hits_of(rendered const& r);   ///< Gaussians met by each pixel's ray

/// The least and the largest value above 0; zeros where there is none.
std::pair<float, float> range_of(image_float const& map);
/// Colours a map of one channel from `low` to `high`: yellow, orange, violet, dark blue; black where it is 0.
image8 in_colors(image_float const& map, float low, float high);
/// The colour map of errors, dark violet over red to pale yellow. Lightness rises with the error, so it also reads in
/// grey. Evenly spaced, linear between them.
inline constexpr u8 error_colors[6][3] = {{10, 8, 26},   {74, 20, 96},   {150, 38, 96},
                                          {218, 76, 62}, {249, 149, 54}, {252, 240, 170}};
/// A map of errors in these colours, from 0 to `high`.
image8 error_in_colors(image_float const& map, float high);
inline constexpr float default_error_scale = 0.25f;  ///< the error at the end of that colour map

/// The absolute difference of two images, mean over the colours: [H][W][1]. The photograph is sampled where it is of
/// another size; alpha in it is laid over the background.
image_float error_between(image_float const& color, image8 const& photo, vec3 background);

/// Features from 0 to 1 in colours: those of in_colors for one, red, green and blue for three. Means along the ray;
/// black where a pixel sees less than half.
image8 features_in_colors(rendered const& r);

/// An image to be looked at.
struct shown_image {
  image8 image;             ///< 1 or 3 channels
  float low = 0, high = 0;  ///< values at the ends of its colour map, where it has one
};
/// What a mode shows of a view. Errors: invalid_argument for view_mode::error without a photograph, and for
/// view_mode::features where `r` has none.
shown_image shown(rendered const& r, camera const& view, view_mode mode, image8 const* photo = nullptr,
                  vec3 background = vec3(0.0f));

}  // namespace gart
