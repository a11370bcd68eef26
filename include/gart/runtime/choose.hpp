#pragma once
/// \file
/// What a capture asks for, told from its cameras and pixels before training starts: `gart train` and `gart eval` take
/// it where an option does not say otherwise. Each choice comes with its reason in words. What cannot be told before,
/// which bands of spherical harmonics pay, is measured (runtime/degree_selection.hpp).
///
/// inspect() reads every pixel's alpha, and of at most 64 training images, evenly spread, the outermost pixels: O(bytes
/// of the images). A border is plain where 95% of those pixels lie within 12 of 255 of their median in every channel:
/// what a bounded object in front of a uniform background looks like, and a photograph of a scene never.

#include <gart/io/dataset.hpp>
#include <gart/runtime/request.hpp>
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
  /// Median over opaque photographs of |ln| of the mean brightness over the nearest pose's.
  double brightness_step = 0;

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

/// Exposures are learned where photographs of neighbouring poses differ in brightness by more than 3%, the median
/// (exposure/exposure.hpp), and the scene is unbounded (docs/calibration.md says what captures give).
chosen<bool> choose_exposure(capture_traits const& traits);

/// The falloff of lenses is learned where photographs fill their images (exposure/vignetting.hpp): an object before a
/// plain background says nothing of the corners, and images of the whole sphere have none.
chosen<bool> choose_vignetting(capture_traits const& traits);

/// The gain that a band of spherical harmonics has to buy to be stored, in dB; 0: nothing is measured. Shorter runs
/// than measured_from would end with a lower score for the views that are held out of their first half (docs/auto.md).
inline constexpr int measured_from = 5000;
inline constexpr float usual_sh_gain = 0.02f;  ///< in dB
/// The choice: usual_sh_gain for runs of at least measured_from steps, else 0.
chosen<float> choose_sh_gain(train_options const& options);

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

/// What keeps a training from learning its photographs by heart (docs/training.md).
struct regularization {
  float dropout = 0;        ///< train_options::dropout
  float dropout_until = 1;  ///< train_options::dropout_until
  float ssim_weight = 0;    ///< train_options::ssim_weight
  float split_share = 0;    ///< train_options::error.split.share
};
inline constexpr int visits_by_heart = 100;  ///< steps for each photograph, from which on it is chosen
inline constexpr int few_photographs = 100;  ///< fewer of them are soon learned by heart
/// What the options say, but for growth by error in an unbounded scene and a run of visits_by_heart. Of few photographs
/// a step leaves out a fifth of the Gaussians. Where photographs differ in brightness and the options learn no
/// exposures, veils say what these would have: there it is 0.3 times the logarithm to base 10 of how many times
/// error_growth_options::least_budget there may be, at most 0.3, the last twentieth of the steps shows the whole scene,
/// halves are nearer, and most of the loss is D-SSIM, in which brightness has little part. Nothing is left out where
/// there cannot be more Gaussians than least_budget: they have little to learn by heart, and need each other.
chosen<regularization> choose_regularization(capture_traits const& traits, train_options const& options);

/// All of these, as `gart train` takes them: what `request` leaves to gart's choice, and in the options background,
/// exposure, vignetting, sh_gain and the regularization, in place of what they say. A choice that is to be another is
/// set afterwards.
struct recommendation {
  configuration_request request;  ///< the configuration
  train_options options;          ///< with the choices in them
};
/// All choices for a capture. O(pixels).
recommendation recommended(train_options const& options, dataset const& data,
                           configuration_request const& request = {});

/// Whether undistort() and the lens agree over the whole image, and neighbours stay neighbours.
bool one_to_one(camera const& view);

}  // namespace gart
