#include <gart/camera/models.hpp>
#include <gart/core/words.hpp>
#include <gart/runtime/capture_defaults.hpp>
#include <gart/train/densify/error_growth.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace gart {

namespace {

constexpr std::size_t most_images = 64;
constexpr int plain_levels = 12;      // of 255
constexpr double plain_share = 0.95;  // of the border's pixels
constexpr int white_from = 230, black_to = 25;
constexpr std::size_t fewest_matched = 1000;

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, share > 0 && share < 0.001 ? "%.2g%%" : "%.1f%%", 100 * share);
  return text;
}

// f(pixel, channels) for the outermost pixels of some training images; images have 3 or 4 channels.
template <class F>
void for_each_border_pixel(dataset const& data, F const& f) {
  std::size_t const images = std::min(data.train.size(), most_images);
  for (std::size_t i = 0; i < images; ++i) {
    image8 const& image = data.train[i * data.train.size() / images].image;
    for (int y = 0; y < image.height; ++y) {
      bool const all = y == 0 || y == image.height - 1 || image.width == 1;
      for (int x = 0; x < image.width; x += all ? 1 : image.width - 1) f(&image.at(x, y, 0), image.channels);
    }
  }
}

void look_at_borders(dataset const& data, capture_traits& traits) {
  std::array<std::array<std::size_t, 256>, 3> histogram{};
  std::size_t pixels = 0, clear = 0, alike = 0;
  for_each_border_pixel(data, [&](u8 const* p, int channels) {
    ++pixels, clear += channels == 4 && p[3] == 0;
    for (std::size_t c = 0; c < 3; ++c) ++histogram[c][p[c]];
  });
  if (pixels == 0) return;
  auto const most = [&](std::size_t n) { return static_cast<double>(n) >= plain_share * static_cast<double>(pixels); };
  traits.clear_border = most(clear);
  if (clear) return;
  for (std::size_t c = 0; c < 3; ++c) {
    std::size_t level = 0, below = histogram[c][0];
    while (2 * below < pixels) below += histogram[c][++level];
    traits.border[c] = static_cast<u8>(level);
  }
  for_each_border_pixel(data, [&](u8 const* p, int) {
    bool near = true;
    for (int c = 0; c < 3; ++c) near = near && std::abs(p[c] - traits.border[c]) <= plain_levels;
    alike += near;
  });
  traits.plain_border = most(alike);
}

std::string lenses(capture_traits const& t) {
  return t.distorted == 0 ? "the lenses are pinholes"
                          : "the lenses of " + counted(t.distorted, "view") + " are distorted, and traced as they are";
}

std::string folds(capture_traits const& t) {
  return "the lenses of " + counted(t.folding, "view") + " are not one to one over the image, and footprints need that";
}

}  // namespace

bool one_to_one(camera const& view) {
  return visit_camera(view, [](auto const& model) { return model.one_to_one(); });
}

capture_traits inspect(dataset const& data) {
  capture_traits traits;
  traits.views = data.train.size(), traits.pixels = data.training_pixels();
  traits.points = data.points.size(), traits.matched = data.matched.size();
  for (auto const* views : {&data.train, &data.test}) {
    for (dataset_view const& v : *views) {
      if (v.view.kind == camera_kind::perspective && !v.view.lens.any()) continue;
      ++traits.distorted;
      traits.folding += !one_to_one(v.view);
      traits.panoramas += v.view.kind == camera_kind::equirectangular;
    }
  }
  std::size_t pixels = 0, clear = 0;
  for (dataset_view const& v : data.train) {
    traits.masked += !v.mask.empty();
    if (v.image.empty()) continue;
    pixels += v.image.data.size() / static_cast<std::size_t>(v.image.channels);
    if (v.image.channels != 4) continue;
    for (std::size_t i = 3; i < v.image.data.size(); i += 4) clear += v.image.data[i] != 255;
  }
  if (pixels) traits.transparent = static_cast<double>(clear) / static_cast<double>(pixels);
  look_at_borders(data, traits);
  return traits;
}

decision<background_kind> choose_background(capture_traits const& t) {
  if (t.transparent > 0) {
    return {background_kind::white,
            percent(t.transparent) + " of the pixels are transparent, and published results have white there"};
  }
  if (!t.plain_border) return {background_kind::black, "the scene fills the images"};
  std::string const color =
      std::to_string(t.border[0]) + " " + std::to_string(t.border[1]) + " " + std::to_string(t.border[2]);
  auto const [low, high] = std::minmax_element(std::begin(t.border), std::end(t.border));
  if (*low >= white_from) return {background_kind::white, "the images' borders are plain white (" + color + ")"};
  if (*high <= black_to) return {background_kind::black, "the images' borders are plain black (" + color + ")"};
  return {background_kind::black,
          "the images' borders are plain (" + color + "), neither white nor black: Gaussians show it"};
}

decision<tracer_kind> choose_tracer(capture_traits const& t) {
  if (t.folding) return {tracer_kind::bvh, folds(t)};
  return {tracer_kind::automatic, lenses(t)};
}

decision<std::string> choose_backward(capture_traits const& t) {
  if (t.folding) return {"pixel", folds(t)};
  return {"auto", "the fastest there is"};
}

decision<bool> choose_match(capture_traits const& t) {
  if (t.points) return {false, "the capture has points"};
  if (t.matched >= fewest_matched) return {true, "the capture has no points"};
  return {false, t.matched ? "too few were found: " + std::to_string(t.matched) : "photographs were not matched"};
}

decision<starting_points> choose_start(dataset const& data, train_options const& options) {
  starting_points start;
  bool const mapped = options.depth_weight > 0 && std::any_of(data.train.begin(), data.train.end(),
                                                              [](dataset_view const& v) { return !v.depth.empty(); });
  start.matched = options.match && data.matched.size() > 0;
  std::size_t const given = data.points.size() + (start.matched ? data.matched.size() : 0);
  start.measured = given == 0 && mapped, start.random = given == 0 && !mapped;
  bool const sparse = start.random && (options.densify == densify_kind::error || options.densify == densify_kind::mcmc);
  std::size_t const points = given == 0 ? options.random_points : given;
  start.count = static_cast<index_t>(std::min<std::size_t>(points, options.max_gaussians));
  start.opacity = options.initial_opacity != 0 ? options.initial_opacity : sparse ? 0.5f : 0.1f;
  start.scale = options.initial_scale != 0 ? options.initial_scale : sparse ? 0.1f : 1.0f;
  return {start, start.measured  ? "what depth maps measured lies on surfaces"
                 : start.matched ? "points matched in photographs lie on surfaces"
                 : !start.random ? "the capture's points lie on surfaces"
                 : sparse        ? "random points are mostly in empty space, and the dead move"
                                 : "random points"};
}

decision<index_t> choose_budget(dataset const& data, train_options const& options) {
  index_t const most = options.max_gaussians;
  if (options.densify != densify_kind::error) return {most, "as many as there may be"};
  index_t const budget = growth_budget(options.error, most, data.training_pixels());
  if (budget == most) return {most, "as many as there may be; the photographs have pixels for them"};
  char text[128];
  std::snprintf(text, sizeof text, "one for %g training pixels, and at least %d: more would overfit them",
                static_cast<double>(options.error.pixels_per_gaussian), options.error.min_gaussians);
  return {budget, text};
}

recommendation recommended(train_options const& options, dataset const& data, configuration_request const& request,
                           std::vector<std::string> const& given, validation_progress const& progress) {
  capture_traits const traits = inspect(data);
  auto const is_given = [&](std::string const& setting) {
    return std::find(given.begin(), given.end(), setting) != given.end();
  };
  bool const length_given = options.iterations != train_options{}.iterations;
  recommendation all{request, options, {}};
  if (request.tracer == tracer_kind::automatic) all.request.tracer = choose_tracer(traits).value;
  if (request.backward == "auto") all.request.backward = choose_backward(traits).value;
  if (!is_given("background")) all.options.background = choose_background(traits).value;
  if (!is_given("match")) all.options.match = choose_match(traits).value;
  std::vector<candidate> candidates;
  for (candidate& c : default_candidates(traits, all.options))
    if (!is_given(c.setting) && !(c.shortens && length_given)) candidates.push_back(std::move(c));
  all.measured = validate(all.request, all.options, data, candidates, progress);
  all.options = all.measured.options;
  return all;
}

}  // namespace gart
