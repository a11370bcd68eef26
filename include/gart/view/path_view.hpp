#pragma once
/// \file
/// Views of Gaussians among meshes and lights, by paths of light, for a viewer. While a view moves: one sample and at
/// most one bounce. At rest: samples that add up to `paths.samples`, some of them at a time. Shown as the options' tone
/// maps it. Distances, normals and opacity are those that a path through the middle of a pixel meets first.
///
/// Cost: view_render.colours of a view at rest takes 0.4 s, or as long as one sample takes. Errors: as path_renderer.

#include <gart/light/path_options.hpp>
#include <gart/render/options.hpp>
#include <gart/runtime/path_renderer.hpp>
#include <gart/view/model_view.hpp>

namespace gart {

/// By a path renderer that is used for nothing else and outlives it. It has a scene or is given one before a view.
/// Gaussians need not be there.
view_render render_of(path_renderer& by, gaussian_model model, render_options options, light::path_options paths);

}  // namespace gart
