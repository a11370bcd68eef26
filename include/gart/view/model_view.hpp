#pragma once
/// \file
/// Views of a model that does not change, for a viewer: what view_server renders by. Settings that change the Gaussians
/// (a crop box, another size) give the renderer a changed copy.

#include <gart/render/options.hpp>
#include <gart/render/rendered.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/view/scene.hpp>

#include <concepts>
#include <functional>
#include <utility>

namespace gart {

/// Renders views to host memory: any function from a camera and settings to images. Called from one thread at a time;
/// what it throws is told to the client.
struct view_render {
  /// Everything a pixel can tell.
  std::function<rendered(camera const& view, view_settings const& settings)> images;
  /// The view's colours as to_8bit of `images`, [H][W][3]; view_mode::colour uses it where it is given. On a device it
  /// spares the copy of the rest.
  std::function<image8(camera const& view, view_settings const& settings)> colours;
  /// The values of the one feature of `settings` that are at the ends of its colours. None: features are not shown.
  std::function<std::pair<float, float>(view_settings const& settings)> feature_range;
  /// Samples that the last of `colours` has, and those that it is to have at rest: settings.effort is heeded. None: a
  /// view is done at once.
  std::function<std::pair<int, int>()> samples;
  /// Whether settings.rows is heeded: then a view that takes long is asked for in parts. Else each part is the whole.
  bool in_parts = false;

  view_render() = default;
  /// From a function that renders everything, and optionally one for the colours alone.
  template <std::invocable<camera const&, view_settings const&> F>
  view_render(F all, decltype(colours) alone = {}) : images(std::move(all)), colours(std::move(alone)) {}
};

/// That of a model, by a renderer that is used for nothing else and outlives it.
view_render render_of(renderer& by, gaussian_model model, render_options options);

}  // namespace gart
