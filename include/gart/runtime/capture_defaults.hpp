#pragma once
/// \file
/// The options that suit a capture, chosen before training starts. `gart train` and `gart eval` take them where the
/// user gives none. Cameras and pixels decide some of them, each with its reason in words. Short trainings decide the
/// others (runtime/validation.hpp).
///
/// inspect() reads every pixel's alpha, and the outermost pixels of at most 64 training images, evenly spread. O(bytes
/// of the images). A border is plain where 95% of its pixels lie within 12 of 255 of their median in every channel.
/// Bounded objects before a uniform background look like that; photographs of a scene do not.

#include <gart/io/dataset.hpp>
#include <gart/runtime/request.hpp>
#include <gart/runtime/validation.hpp>
#include <gart/train/options.hpp>

#include <string>

namespace gart {

/// The properties of a capture that choices depend on.
struct capture_traits {
  std::size_t distorted = 0;  ///< training and test views whose lens is no pinhole
  std::size_t folding = 0;    ///< of these, lenses that are not one to one over the image
  std::size_t panoramas = 0;  ///< of these, images of the whole sphere, which no lens makes
  double transparent = 0;     ///< share of the training images' pixels that are not opaque
  std::size_t masked = 0;     ///< training views with a mask
  bool clear_border = false;  ///< the images' borders are transparent
  bool plain_border = false;  ///< the borders are opaque and of one colour
  u8 border[3] = {0, 0, 0};   ///< the colour of a plain border
  std::size_t views = 0;      ///< training views
  u64 pixels = 0;             ///< pixels of all training views
  std::size_t points = 0;     ///< of the capture's files
  std::size_t matched = 0;    ///< points matched in the photographs

  /// Whether the objects stand before a background that does not belong to the scene.
  bool bounded() const { return clear_border || plain_border; }
};

/// Reads lenses, poses and pixels of the views. O(pixels).
capture_traits inspect(dataset const& data);

/// A choice and its reason.
template <class T>
struct decision {
  T value;          ///< what is chosen
  std::string why;  ///< in words, for reports
};

/// White for transparent images, as published results have it, and for plain white borders; else black.
decision<background_kind> choose_background(capture_traits const& traits);

/// The tiles tracer and every method but pixel need footprints. Footprints need a lens that is one to one over the
/// image. Where a lens folds: bvh and pixel. Else "auto", the fastest.
decision<tracer_kind> choose_tracer(capture_traits const& traits);
/// The method for choose_tracer's tracer.
decision<std::string> choose_backward(capture_traits const& traits);

/// Whether to start from points matched in the photographs (dataset::matched): where the capture has no points, and at
/// least 1,000 were matched. Fewer leave most of a scene empty. Where a capture has points, trials tell
/// (default_candidates).
decision<bool> choose_match(capture_traits const& traits);

/// The capture's points, and with options.match those matched in its photographs. Without any, those that depth maps
/// measured where depth is trained on. Else random ones in the capture's bounds. Points of the first three kinds lie on
/// surfaces. Opacity 0.1 and a scale of 1.0 (times the distance to the neighbours) fill the gaps between them. Random
/// points mostly lie in empty space. With MCMC, which moves them, 0.5 and 0.1 let rays through from the first step.
/// Values that the options give stay.
struct starting_points {
  bool random = false;    ///< in the capture's bounds
  bool measured = false;  ///< measured by depth maps; neither: the capture's own, or
  bool matched = false;   ///< those matched in the photographs, beside the capture's own
  index_t count = 0;      ///< of points
  float opacity = 0,      ///< of the first Gaussians
      scale = 0;          ///< times the distance to the neighbours
};
/// Where training starts; the reason names the numbers.
decision<starting_points> choose_start(dataset const& data, train_options const& options);

/// The largest number of Gaussians: max_gaussians, or the budget by pixels for growth by error (growth_budget).
decision<index_t> choose_budget(dataset const& data, train_options const& options);

/// All choices for a capture, as `gart train` takes them. Callers may change them afterwards.
struct recommendation {
  configuration_request request;  ///< for make_session
  train_options options;          ///< options with the choices
  validation measured;            ///< the trials behind them
};
/// Fills in what `request` leaves open, the background, the points to start from, and the default candidates. Settings
/// named in `given` stay as they are, and so does a number of iterations other than the usual. Cost: O(pixels), and the
/// trials.
recommendation recommended(train_options const& options, dataset const& data, configuration_request const& request = {},
                           std::vector<std::string> const& given = {}, validation_progress const& progress = {});

/// Whether undistort() and the lens agree over the whole image, and neighbours stay neighbours.
bool one_to_one(camera const& view);

}  // namespace gart
