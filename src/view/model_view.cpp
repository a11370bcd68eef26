// A model, and what is traced in its place where a viewer wants it otherwise.

#include <gart/io/image_file.hpp>
#include <gart/view/model_view.hpp>

#include <memory>
#include <utility>

namespace gart {

namespace {

struct model_view {
  renderer& by;
  gaussian_model model;
  render_options options;
  int kernel_degree;
  float extent;
  view_settings held = {};  // those of the Gaussians that the renderer holds
  std::size_t left = 0;     // how many these are

  render_options with(view_settings const& settings) {
    take(settings);
    render_options out = options;
    if (settings.near) out.near = *settings.near;
    if (settings.background) out.background = *settings.background;
    if (settings.shape != view_shape::gaussians) out.alpha_min = solid_response, out.antialias = 0;
    out.rows = settings.rows;
    return out;
  }
  void take(view_settings const& s) {
    if (s.crop == held.crop && s.opacity == held.opacity && s.size == held.size && s.shape == held.shape) return;
    gaussian_model const part = s.own_gaussians() ? gaussian_model() : altered(model, s, kernel_degree, extent);
    gaussian_model const& taken = s.own_gaussians() ? model : part;
    left = taken.size();
    if (left > 0) by.set_model(taken);
    held = s;
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
  float const extent = extent_of(scene_of("", model, 2));
  int const kernel_degree = by.configuration().kernel_degree;
  auto const held = std::make_shared<model_view>(model_view{by, std::move(model), options, kernel_degree, extent});
  held->left = held->model.size();
  if (held->left > 0) by.set_model(held->model);
  view_render render(
      [held](camera const& view, view_settings const& settings) {
        render_options const with = held->with(settings);
        return held->left > 0 ? held->by.render(view, with) : nothing(view, with.background);
      },
      [held](camera const& view, view_settings const& settings) {
        render_options const with = held->with(settings);
        return held->left > 0 ? held->by.render_8bit(view, with) : to_8bit(nothing(view, with.background).color);
      });
  render.in_parts = true;
  return render;
}

}  // namespace gart
