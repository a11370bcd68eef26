// A model and the part of it that a crop box leaves.

#include <gart/io/image_file.hpp>
#include <gart/view/model_view.hpp>

#include <algorithm>
#include <memory>
#include <utility>

namespace gart {

namespace {

struct model_view {
  renderer& by;
  gaussian_model model;
  render_options options;
  std::optional<view_box> crop;  // of what the renderer holds
  std::size_t left = 0;          // Gaussians that it holds

  render_options with(view_settings const& settings) {
    take(settings.crop);
    render_options out = options;
    if (settings.near) out.near = *settings.near;
    return out;
  }
  void take(std::optional<view_box> const& box) {
    if (box == crop) return;
    gaussian_model const part = box ? cropped(model, *box) : gaussian_model();
    gaussian_model const& held = box ? part : model;
    left = held.size();
    if (left > 0) by.set_model(held);
    crop = box;
  }
};

// What is seen where there is nothing.
rendered nothing(camera const& view, vec3 background) {
  rendered r{image_float(view.width, view.height, 3), image_float(view.width, view.height, 1, 1.0f),
             image_float(view.width, view.height, 1), basic_image<u32>(view.width, view.height, 1)};
  for (std::size_t i = 0; i < r.color.data.size(); ++i) r.color.data[i] = background[static_cast<int>(i % 3)];
  return r;
}

}  // namespace

view_render render_of(renderer& by, gaussian_model model, render_options options) {
  auto const held = std::make_shared<model_view>(model_view{by, std::move(model), options, {}, 0});
  held->left = held->model.size();
  if (held->left > 0) by.set_model(held->model);
  return {[held](camera const& view, view_settings const& settings) {
            render_options const with = held->with(settings);
            return held->left > 0 ? held->by.render(view, with) : nothing(view, with.background);
          },
          [held](camera const& view, view_settings const& settings) {
            render_options const with = held->with(settings);
            return held->left > 0 ? held->by.render_8bit(view, with) : to_8bit(nothing(view, with.background).color);
          }};
}

}  // namespace gart
