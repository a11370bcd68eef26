#pragma once
/// \file
/// What a capture asks for, known before training starts: `gart train` and `gart eval` take it where an option does not
/// say otherwise. What cameras and pixels tell for certain is read of them, with its reason in words; what they do not
/// is measured in short trainings (runtime/validation.hpp).
///
/// inspect() reads every pixel's alpha, and of at most 64 training images, evenly spread, the outermost pixels: O(bytes
/// of the images). A border is plain where 95% of those pixels lie within 12 of 255 of their median in every channel:
/// what a bounded object in front of a uniform background looks like, and a photograph of a scene never.

#include <gart/io/dataset.hpp>
#include <gart/runtime/request.hpp>
#include <gart/runtime/validation.hpp>
#include <gart/train/options.hpp>

#include <string>

namespace gart {

/// What a capture shows of itself, that choices go by.
struct capture_traits {
  std::size_t distorted = 0;  ///< training and test views whose lens is no pinhole
  std::size_t folding = 0;    ///< of these, lenses that are not one to one over the image
  std::size_t panoramas = 0;  ///< of these, images of the whole sphere, which no lens makes
  double transparent = 0;     ///< share of the training images' pixels that are not opaque
  std::size_t masked = 0;     ///< training views with a mask
  bool clear_border = false;  ///< the images' borders are transparent
  bool plain_border = false;  ///< or opaque, and of one colour,
  u8 border[3] = {0, 0, 0};   ///< which is this
  std::size_t views = 0;      ///< training views
  u64 pixels = 0;             ///< and their pixels

  /// Whether its objects stand before a background that is not of the scene.
  bool bounded() const { return clear_border || plain_border; }
};

/// Reads lenses, poses and pixels of the views. O(pixels).
capture_traits inspect(dataset const& data);

/// A choice and its reason.
template <class T>
struct chosen {
  T value;          ///< what is chosen
  std::string why;  ///< in words, for reports
};

/// White for transparent images, as published results have it, and for plain white borders; else black.
chosen<background_kind> choose_background(capture_traits const& traits);

/// Footprints, which the tiles tracer and every strategy but pixel stand on, need a lens that is one to one over the
/// image: where one is not, bvh and pixel; else "auto", the fastest there is.
chosen<tracer_kind> choose_tracer(capture_traits const& traits);
/// As choose_tracer has it.
chosen<std::string> choose_backward(capture_traits const& traits);

/// The capture's points; where it has none and depth is trained on, points that its depth maps measured; else random
/// ones in its bounds. A capture's points lie on surfaces, and opacity 0.1 and a scale of 1.0 (times the distance to
/// the neighbours) fill the gaps between them. Random points are mostly in empty space: with MCMC, which moves them,
/// 0.5 and 0.1 let rays through from the first step. What the options say stands.
struct starting_points {
  bool random = false;    ///< in the capture's bounds
  bool measured = false;  ///< of its depth maps; neither: the capture's own
  index_t count = 0;      ///< of points
  float opacity = 0,      ///< of the first Gaussians
      scale = 0;          ///< times the distance to the neighbours
};
/// Where training starts; the reason names the numbers.
chosen<starting_points> choose_start(dataset const& data, train_options const& options);

/// The count that the options let the capture grow to: max_gaussians, or what growth by error takes its pixels for
/// (growth_budget).
chosen<index_t> choose_budget(dataset const& data, train_options const& options);

/// All choices for a capture, as `gart train` takes them. A choice that is to be another is set afterwards.
struct recommendation {
  configuration_request request;  ///< the configuration
  train_options options;          ///< with the choices in them
  validation measured;            ///< what was tried for them
};
/// What `request` leaves to gart's choice, and in the options the background and the usual candidates, in place of what
/// they say; but for settings that are `given`, which stay. O(pixels), and the trials.
recommendation recommended(train_options const& options, dataset const& data, configuration_request const& request = {},
                           std::vector<std::string> const& given = {}, validation_progress const& progress = {});

/// Whether undistort() and the lens agree over the whole image, and neighbours stay neighbours.
bool one_to_one(camera const& view);

}  // namespace gart
