#include <gart/camera/models.hpp>
#include <gart/exposure/exposure_field.hpp>
#include <gart/optim/error_growth.hpp>
#include <gart/runtime/choose.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

namespace gart {

namespace {

constexpr std::size_t most_images = 64;
constexpr int plain_levels = 12;      // of 255
constexpr double plain_share = 0.95;  // of the border's pixels
constexpr double brightness_step_most = 0.03;
constexpr int white_from = 230, black_to = 25;

std::string percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, share > 0 && share < 0.001 ? "%.2g%%" : "%.1f%%", 100 * share);
  return text;
}

// What stands before a background that is not of the scene.
bool is_object(capture_traits const& t) { return t.bounded() || t.transparent > 0; }

std::string counted(std::size_t n, char const* noun) { return std::to_string(n) + " " + noun + (n == 1 ? "" : "s"); }

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

// Of opaque photographs, every seventh pixel of a row; 0 where fewer than two are.
double brightness_step(std::vector<dataset_view> const& views) {
  std::vector<view_exposure> poses;
  std::vector<double> level;
  for (dataset_view const& v : views) {
    if (v.image.channels != 3 || v.image.empty()) continue;
    double sum = 0;
    std::size_t values = 0;
    for (std::size_t i = 0; i < v.image.data.size(); i += 7) sum += v.image.data[i], ++values;
    poses.push_back({v.name, v.view.position, v.view.rotation[2], {}});
    level.push_back(std::log(std::max(sum / static_cast<double>(values), 1.0)));
  }
  exposure_field const field(std::move(poses));
  std::vector<double> steps;
  for (std::size_t i = 0; i < level.size() && level.size() > 1; ++i)
    steps.push_back(std::abs(level[i] - level[field.nearest(i)]));
  if (steps.empty()) return 0;
  auto const middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

std::string lenses(capture_traits const& t) {
  return t.distorted == 0 ? "the lenses are pinholes"
                          : "the lenses of " + counted(t.distorted, "view") + " are distorted, and traced as they are";
}

std::string folds(capture_traits const& t) {
  return "the lenses of " + counted(t.folding, "view") + " are not one to one over the image, and footprints need that";
}

// The fewer Gaussians there are, the less another can stand in for one that is left out. In whole hundredths, upwards:
// none only where there are no more than the least budget.
float rising_dropout(index_t budget, error_growth_options const& options) {
  constexpr double most_hundredths = 30;
  double const times = static_cast<double>(budget) / std::max(options.least_budget, 1);
  return static_cast<float>(std::ceil(most_hundredths * std::clamp(std::log10(times), 0.0, 1.0)) / 100);
}

}  // namespace

bool one_to_one(camera const& view) {
  return visit_camera(view, [](auto const& model) { return model.one_to_one(); });
}

capture_traits inspect(dataset const& data) {
  capture_traits traits;
  traits.views = data.train.size(), traits.pixels = data.training_pixels();
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
  traits.brightness_step = brightness_step(data.train);
  return traits;
}

chosen<background_kind> choose_background(capture_traits const& t) {
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

chosen<tracer_kind> choose_tracer(capture_traits const& t) {
  if (t.folding) return {tracer_kind::bvh, folds(t)};
  return {tracer_kind::automatic, lenses(t)};
}

chosen<std::string> choose_backward(capture_traits const& t) {
  if (t.folding) return {"pixel", folds(t)};
  return {"auto", "the fastest there is"};
}

chosen<bool> choose_exposure(capture_traits const& t) {
  if (is_object(t)) return {false, "a bounded object, lit alike in all images"};
  std::string const step = percent(t.brightness_step);
  if (t.brightness_step > brightness_step_most)
    return {true, "the brightness of neighbouring photographs differs by " + step};
  return {false, "the brightness of neighbouring photographs differs by " + step + " only"};
}

chosen<bool> choose_vignetting(capture_traits const& t) {
  if (is_object(t)) return {false, "a bounded object, which says nothing of the corners"};
  if (t.panoramas) return {false, counted(t.panoramas, "view") + " of the whole sphere, which have no corners"};
  return {true, "photographs, which lenses darken towards the corners"};
}

chosen<starting_points> choose_start(dataset const& data, train_options const& options) {
  starting_points start;
  bool const mapped = options.depth_weight > 0 && std::any_of(data.train.begin(), data.train.end(),
                                                              [](dataset_view const& v) { return !v.depth.empty(); });
  start.measured = data.points.size() == 0 && mapped, start.random = data.points.size() == 0 && !mapped;
  bool const sparse = start.random && (options.densify == densify_kind::error || options.densify == densify_kind::mcmc);
  std::size_t const points = start.random || start.measured ? options.random_points : data.points.size();
  start.count = static_cast<index_t>(std::min<std::size_t>(points, options.max_gaussians));
  start.opacity = options.initial_opacity != 0 ? options.initial_opacity : sparse ? 0.5f : 0.1f;
  start.scale = options.initial_scale != 0 ? options.initial_scale : sparse ? 0.1f : 1.0f;
  return {start, start.measured  ? "what depth maps measured lies on surfaces"
                 : !start.random ? "the capture's points lie on surfaces"
                 : sparse        ? "random points are mostly in empty space, and the dead move"
                                 : "random points"};
}

chosen<index_t> choose_budget(dataset const& data, train_options const& options) {
  index_t const most = options.max_gaussians;
  if (options.densify != densify_kind::error) return {most, "as many as there may be"};
  index_t const budget = growth_budget(options.error, most, data.training_pixels());
  if (budget == most) return {most, "as many as there may be; the photographs have pixels for them"};
  char text[128];
  std::snprintf(text, sizeof text, "one for %g training pixels, and at least %d: more would learn them by heart",
                static_cast<double>(options.error.pixels_each), options.error.least_budget);
  return {budget, text};
}

chosen<regularization> choose_regularization(capture_traits const& t, train_options const& options) {
  regularization const as_said{options.dropout, options.dropout_until, options.ssim_weight, options.error.split.share};
  if (options.densify != densify_kind::error) return {as_said, "measured with growth by error alone"};
  if (is_object(t)) return {as_said, "a bounded object"};
  std::size_t const visits = static_cast<std::size_t>(options.iterations) / std::max<std::size_t>(t.views, 1);
  std::string const shown = "each of " + counted(t.views, "photograph") + " is shown " + counted(visits, "time");
  if (visits < visits_by_heart) return {as_said, shown + " only"};
  float const rising = rising_dropout(growth_budget(options.error, options.max_gaussians, t.pixels), options.error);
  regularization careful = as_said;
  if (!options.exposure && choose_exposure(t).value) {
    if (rising > 0) careful.dropout = rising, careful.dropout_until = 0.95f;
    careful.ssim_weight = 0.6f, careful.split_share = 0.25f;
    return {careful, shown + ", they differ in brightness, and no exposure is learned"};
  }
  if (rising == 0) return {as_said, "few Gaussians need each other"};
  if (t.views >= few_photographs) return {as_said, "there are many photographs"};
  careful.dropout = 0.2f;
  return {careful, shown};
}

chosen<float> choose_sh_gain(train_options const& options) {
  if (options.iterations >= measured_from) return {usual_sh_gain, "what a band buys is measured"};
  return {0, "a run of less than " + std::to_string(measured_from) + " steps would miss the views held out"};
}

recommendation recommended(train_options const& options, dataset const& data, configuration_request const& request) {
  capture_traits const traits = inspect(data);
  recommendation all{request, options};
  if (request.tracer == tracer_kind::automatic) all.request.tracer = choose_tracer(traits).value;
  if (request.backward == "auto") all.request.backward = choose_backward(traits).value;
  all.options.background = choose_background(traits).value;
  all.options.exposure = choose_exposure(traits).value;
  all.options.vignetting = choose_vignetting(traits).value;
  all.options.sh_gain = choose_sh_gain(options).value;
  regularization const r = choose_regularization(traits, all.options).value;
  all.options.dropout = r.dropout, all.options.dropout_until = r.dropout_until;
  all.options.ssim_weight = r.ssim_weight, all.options.error.split.share = r.split_share;
  return all;
}

}  // namespace gart
