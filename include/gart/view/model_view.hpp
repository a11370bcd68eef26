#pragma once
/// \file
/// Views of a model that does not change, for a viewer: what view_server renders by. The Gaussians outside of a crop
/// box are left out of a copy, which is made when the box changes and held by the renderer.

#include <gart/render/options.hpp>
#include <gart/render/rendered.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/view/scene.hpp>

#include <functional>

namespace gart {

/// Renders a view to host memory. Called from one thread at a time; what it throws is told to the client.
using view_render = std::function<rendered(camera const& view, view_settings const& settings)>;

/// That of a model, by a renderer that is used for nothing else and outlives it.
view_render render_of(renderer& by, gaussian_model model, render_options options);

}  // namespace gart
