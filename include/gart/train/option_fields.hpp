#pragma once
/// \file
/// The numbers and switches of train_options, once: each with its name, its place, its range and its help. A program's
/// options, its records of them, and the checks of a run come from this table. Errors: require_options throws
/// invalid_argument, naming the field, its value and its range.

#include <gart/core/error.hpp>
#include <gart/train/options.hpp>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

namespace gart {

/// One of them.
struct option_field {
  /// Where it is in some options, by its type.
  using place = std::variant<float& (*)(train_options&), int& (*)(train_options&), u32& (*)(train_options&),
                             u64& (*)(train_options&), bool& (*)(train_options&)>;
  std::string_view name;   ///< of the member: "rates.opacity"
  place of;                ///< the member
  double low, high;        ///< its range
  std::string_view group;  ///< heading in the help
  std::string_view help;   ///< help, with the unit

  /// Whether it takes no fractions.
  bool whole() const { return of.index() > 0; }
  /// Its value.
  double get(train_options const& options) const {
    return std::visit([&](auto at) { return static_cast<double>(at(const_cast<train_options&>(options))); }, of);
  }
  /// Another.
  void set(train_options& options, double value) const {
    std::visit([&](auto at) { at(options) = static_cast<std::remove_reference_t<decltype(at(options))>>(value); }, of);
  }
};

// Name and member cannot differ.
#define GART_FIELD(path) \
#path, [](train_options & o) -> auto& { return o.path; }

/// All of them, in the order of the help.
inline constexpr option_field option_fields[] = {
    {GART_FIELD(iterations), 1, 1e9, "Training",
     "Steps, one training view each; where none are given,\ntrials may choose a third"},
    {GART_FIELD(max_gaussians), 1, 4294967295.0, "Training",
     "Gaussians at most; memory and time grow with them. Growth by\nerror ends at one for each 200 training pixels "
     "where that is\nless (and over 100,000)"},
    {GART_FIELD(random_points), 1, 2147483647.0, "Training",
     "Gaussians to start with where the capture has no points: at\nrandom, or where its depth maps are trained on, of "
     "these; and\npixels of the photographs that are matched"},
    {GART_FIELD(initial_opacity), 0, 0.99, "Training",
     "Opacity of the first Gaussians, below 1; 0: 0.5 for random\npoints with error or mcmc, else 0.1"},
    {GART_FIELD(initial_scale), 0, 100, "Training",
     "Size of the first Gaussians over the distance to their\nneighbours; 0: 0.1 for random points with\nerror or "
     "mcmc, else 1"},
    {GART_FIELD(batch), 1, 4096, "Training",
     "Views a step: the mean of their gradients, at rates times\nsqrt(N). Counts of steps then count images"},
    {GART_FIELD(seed), 0, 18446744073709551615.0, "Training",
     "Seed of everything random; on the serial backend the same\nseed gives the same bits"},
    {GART_FIELD(refine_poses), 0, 1, "Capture",
     "Learn the pose of each training view with the Gaussians, for\ncaptures whose poses are a little off; test views "
     "are then\naligned to their photographs before they are scored"},
    {GART_FIELD(refine_lens), 0, 1, "Capture",
     "Learn the focal length and the centre of each camera of the\ncapture with the Gaussians, for calibrations that "
     "are a little\noff; test views are scored through\nthe learned lenses"},
    {GART_FIELD(depth_weight), 0, 1e6, "Capture",
     "Train by the capture's depth maps too: weight of their mean\nerror, in units of the scene's extent, beside the "
     "colours' loss;\n0: none. Maps are depths/NAME.png (16 bits) or NAME.npy\n(float32) beside images/, or what "
     "'depth_file_path' of a\ntransforms.json names (docs/rendering.md)"},
    {GART_FIELD(render.rebuild_every), 1, 1e6, "Machine",
     "Steps between builds of the bvh tracer's tree, which is\nrefitted in between; the images are the same"},
    {GART_FIELD(render.alpha_min), 1e-6, 0.99, "Accuracy",
     "Opacity below which a Gaussian is not hit, 0 to 1;\n1/255 as elsewhere"},
    {GART_FIELD(render.transmittance_min), 0, 0.99, "Accuracy", "Transmittance below which a ray ends, 0 to 1"},
    {GART_FIELD(render.max_hits), 0, 1e9, "Accuracy", "Hits after which a ray ends, 0: no cap"},
    {GART_FIELD(check_finite), 0, 1, "Course",
     "After each step look for numbers that are not finite in all\nparameters and Adam's moments, and stop at the "
     "first with exit\ncode 1; metrics.json says how many steps were checked"},
    {GART_FIELD(near), 1e-9, 1e6, "Rules", "hits lie farther than this, times the scene's extent"},
    {GART_FIELD(ssim_weight), 0, 1, "Rules", "share of D-SSIM in the loss, the rest is L1"},
    {GART_FIELD(render.antialias), 0, 100, "Rules", "standard deviation of the pixels' filter, pixels"},
    {GART_FIELD(dropout), 0, 0.999, "Rules", "share of the Gaussians that each step leaves out"},
    {GART_FIELD(dropout_until), 0, 1, "Rules", "share of the run after which steps leave out none"},
    {GART_FIELD(resolution.quarter_until), 0, 1, "Rules", "share of the run with a quarter of the pixels a side"},
    {GART_FIELD(resolution.half_until), 0, 1, "Rules", "share of the run with half or less"},
    {GART_FIELD(resolution.least), 1, 1e6, "Rules", "pixels a side that images keep"},
    {GART_FIELD(resolution.long_run), 1, 1e9, "Rules", "steps that a longer run's shares are of"},
    {GART_FIELD(sh_every), 1, 1e9, "Rules", "steps to the next degree of colour"},
    {GART_FIELD(sh_penalty), 0, 1e6, "Rules", "weight of the bands' squares above the first, halved, in the loss"},
    {GART_FIELD(shard_block), 1, 4294967295.0, "Rules", "Gaussians in a row that one of several ranks has"},
    {GART_FIELD(rates.mean), 0, 1e6, "Rules", "Adam's rate of means, times the extent"},
    {GART_FIELD(rates.mean_final), 0, 1e6, "Rules", "the same at the end of the run"},
    {GART_FIELD(rates.log_scale), 0, 1e6, "Rules", "Adam's rate of logarithms of scales"},
    {GART_FIELD(rates.quaternion), 0, 1e6, "Rules", "Adam's rate of quaternions"},
    {GART_FIELD(rates.opacity), 0, 1e6, "Rules", "Adam's rate of opacities' logits"},
    {GART_FIELD(rates.sh_dc), 0, 1e6, "Rules", "Adam's rate of colour's first band"},
    {GART_FIELD(rates.sh_rest), 0, 1e6, "Rules", "Adam's rate of the bands above it"},
    {GART_FIELD(rates.final_scale), 0, 1, "Rules", "share of the rates that is left at the end"},
    {GART_FIELD(rates.decay_start_short), 0, 1, "Rules", "share of the shortest runs before rates fall"},
    {GART_FIELD(rates.long_run), 1, 1e9, "Rules", "steps of a run whose rates are not raised"},
    {GART_FIELD(rates.exposure), 0, 1e6, "Rules", "Adam's rate of exposures, a visit"},
    {GART_FIELD(rates.vignetting), 0, 1e6, "Rules", "Adam's rate of falloffs, a visit"},
    {GART_FIELD(rates.vignetting_final), 0, 1e6, "Rules", "the same at the end of the run"},
    {GART_FIELD(poses.warm_up), 0, 1, "Rules", "share of the run in which poses stay"},
    {GART_FIELD(poses.until), 0, 1, "Rules", "share of the run at which their rates are last"},
    {GART_FIELD(poses.rate), 0, 1e6, "Rules", "radians that the image moves a visit"},
    {GART_FIELD(poses.rate_final), 0, 1e6, "Rules", "the same at the end"},
    {GART_FIELD(poses.damping), 0, 1e9, "Rules", "damping of the metric of poses"},
    {GART_FIELD(poses.damping_final), 0, 1e9, "Rules", "the same at the end"},
    {GART_FIELD(poses.prior), 0, 1e9, "Rules", "pull to the capture's poses"},
    {GART_FIELD(lens.warm_up), 0, 1, "Rules", "share of the run in which lenses stay"},
    {GART_FIELD(lens.until), 0, 1, "Rules", "share of the run at which their rates are last"},
    {GART_FIELD(lens.rate), 0, 1e6, "Rules", "focal lengths that the image moves a step"},
    {GART_FIELD(lens.rate_final), 0, 1e6, "Rules", "the same at the end"},
    {GART_FIELD(error.from), 0, 1e9, "Rules", "first step of growth by error"},
    {GART_FIELD(error.every), 0, 1e9, "Rules", "steps between its densifications"},
    {GART_FIELD(error.growth_end), 0, 1, "Rules", "share of the run at which growth ends"},
    {GART_FIELD(error.until), 0, 1, "Rules", "share of the run after which the dead stay"},
    {GART_FIELD(error.dead_opacity), 0, 0.99, "Rules", "opacity below which a Gaussian is dead"},
    {GART_FIELD(error.opacity_penalty), 0, 1e6, "Rules", "weight of the mean opacity in the loss"},
    {GART_FIELD(error.split.offset), 0, 0.999, "Rules", "distance of split Gaussians; 0: by the capture's pixels"},
    {GART_FIELD(error.split.opacity), 1e-6, 1, "Rules", "factor of opacity at a split"},
    {GART_FIELD(error.pixels_per_gaussian), 0, 1e9, "Rules", "training pixels to a Gaussian at least; 0: any"},
    {GART_FIELD(error.min_gaussians), 0, 2147483647.0, "Rules", "Gaussians that the smallest capture may have"},
    {GART_FIELD(error.draw_by_root), 0, 1, "Rules", "1: splits are drawn by the root of the error, 0: by the error"},
    {GART_FIELD(mcmc.growth), 0, 10, "Rules", "growth a densification of mcmc"},
    {GART_FIELD(mcmc.noise), 0, 1e12, "Rules", "random steps of mcmc, times the rate of means"},
    {GART_FIELD(mcmc.opacity_penalty), 0, 1e6, "Rules", "weight of the mean opacity in the loss"},
    {GART_FIELD(mcmc.scale_penalty), 0, 1e6, "Rules", "weight of the mean scale, over the extent"},
    {GART_FIELD(adc.gradient), 0, 1e6, "Rules", "gradient in the image above which adc grows"},
    {GART_FIELD(adc.until), 0, 1, "Rules", "share of the run after which adc ends"},
    {GART_FIELD(adc.opacity_reset_every), 0, 1e9, "Rules", "steps between resets of opacity"},
};

#undef GART_FIELD

/// The field of that name, or null.
constexpr option_field const* find_option_field(std::string_view name) {
  for (option_field const& f : option_fields)
    if (f.name == name) return &f;
  return nullptr;
}

/// A number as messages show it: the fewest digits that give the float, or else the double, again.
inline std::string short_number(double value) {
  char text[32];
  if (value == std::floor(value) && std::abs(value) < 1e9) {
    std::snprintf(text, sizeof text, "%.0f", value);
    return text;
  }
  auto const single = static_cast<float>(value);
  auto const end = static_cast<double>(single) == value ? std::to_chars(text, std::end(text), single)
                                                        : std::to_chars(text, std::end(text), value);
  return {text, end.ptr};
}

/// Checks all fields.
inline void require_options(train_options const& options) {
  constexpr double slack = 1e-6;  // a float may stand a little beside the bound
  for (option_field const& f : option_fields)
    if (double const value = f.get(options); !(value >= f.low * (1 - slack) && value <= f.high * (1 + slack)))
      throw invalid_argument("train_options." + std::string(f.name) + " is " + short_number(value) + ": from " +
                             short_number(f.low) + " to " + short_number(f.high));
  if (options.render.near != render_options().near)
    throw invalid_argument("train_options.render.near is not used: set train_options.near, in units of the extent");
}

}  // namespace gart
