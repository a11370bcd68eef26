// A model, and what is traced in its place where a viewer wants it otherwise.

#include "held_model.hpp"

#include <gart/io/image_file.hpp>
#include <gart/view/model_view.hpp>

#include <memory>
#include <utility>

namespace gart {

namespace {

// What is seen where there is nothing.
rendered nothing(camera const& view, vec3 background, bool with_features = false) {
  rendered r{image_float(view.width, view.height, 3), image_float(view.width, view.height, 1, 1.0f),
             image_float(view.width, view.height, 1), basic_image<u32>(view.width, view.height, 1)};
  for (std::size_t i = 0; i < r.color.data.size(); ++i) r.color.data[i] = background[static_cast<int>(i % 3)];
  if (with_features) r.features = image_float(view.width, view.height, 1);
  return r;
}

}  // namespace

view_render render_of(renderer& by, gaussian_model model, render_options options) {
  auto const held = std::make_shared<view::held_model>(std::move(model), options, by.configuration().kernel_degree,
                                                       [&by](gaussian_model const& m) { by.set_model(m); });
  view_render render(
      [held, &by](camera const& view, view_settings const& settings) {
        held->take(settings);
        render_options const with = held->options_for(settings);
        bool const features = settings.features.has_value();
        return held->left() > 0 ? by.render(view, with, features) : nothing(view, with.background, features);
      },
      [held, &by](camera const& view, view_settings const& settings) {
        held->take(settings);
        render_options const with = held->options_for(settings);
        return held->left() > 0 ? by.render_8bit(view, with) : to_8bit(nothing(view, with.background).color);
      });
  if (held->has_features())
    render.feature_range = [held](view_settings const& settings) {
      held->take(settings);
      return held->features().ranges.front();
    };
  render.in_parts = true;
  return render;
}

}  // namespace gart
