#include "held_model.hpp"

#include <gart/view/path_view.hpp>

#include <algorithm>
#include <chrono>
#include <memory>
#include <utility>

namespace gart {

namespace {

constexpr double seconds_a_time = 0.4;

struct path_view {
  path_renderer& by;
  light::path_options paths;
  view::held_model held;
  int samples = 0, most = 1;  // of the last picture

  void begin(camera const& view, view_settings const& settings, light::path_options const& options) {
    held.take(settings);
    by.begin(view, held.options_for(settings), options);
  }

  image8 colours(camera const& view, view_settings const& settings) {
    most = paths.samples;
    if (settings.effort == view_effort::draft) {
      light::path_options little = paths;
      little.bounces = std::min(paths.bounces, 1);
      begin(view, settings, little);
      by.add(samples = 1);
    } else {
      if (settings.effort == view_effort::begun) begin(view, settings, paths);
      using clock = std::chrono::steady_clock;
      auto const end = clock::now() + std::chrono::duration<double>(seconds_a_time);
      do by.add(1);
      while (by.samples() < most && clock::now() < end);
      samples = by.samples();
    }
    return by.picture_8bit();
  }

  rendered images(camera const& view, view_settings const& settings) {
    begin(view, settings, paths);
    rendered out = depth_of(by.layers());
    out.color = image_float(view.width, view.height, 3);
    return out;
  }
};

}  // namespace

view_render render_of(path_renderer& by, gaussian_model model, render_options options, light::path_options paths) {
  light::require_path_options(paths);
  options.antialias = 0;  // samples fill the pixels
  auto const held =
      std::make_shared<path_view>(path_view{by, paths,
                                            view::held_model(
                                                std::move(model), options, by.configuration().kernel_degree,
                                                [&by](gaussian_model const& m) { by.set_model(m); }, true)});
  view_render render([held](camera const& v, view_settings const& s) { return held->images(v, s); },
                     [held](camera const& v, view_settings const& s) { return held->colours(v, s); });
  render.samples = [held] { return std::pair(held->samples, held->most); };
  return render;
}

}  // namespace gart
