#pragma once
/// \file
/// What a training learns besides the Gaussians, or compares besides colours: exposures, vignetting, poses, lenses,
/// depth. A part is a class on learned_part<Frame>, which does nothing; those of the library are listed in parts.hpp,
/// and a program adds its own by trainer::learn. In the order of a step, each image by the ranks that trace it:
///   view            the camera that the image is traced by
///   before_loss     the image as the photograph would show it
///   after_loss      dL/d of that becomes dL/d image; the last part first
///   after_backward  where the pass and its frame are still there
///   after_gradients dL/d Gaussians by this view alone are there; called on all ranks
///   found           on the host, what is left to find in the image
///   step            on all ranks: moves what is learned, by the numbers that the image gave
/// An image gives each part `numbers` floats, in the policy's memory until found. They travel to all ranks.

#include <gart/backward/backward.hpp>
#include <gart/core/named_arrays.hpp>
#include <gart/exposure/exposure_field.hpp>
#include <gart/io/dataset.hpp>
#include <gart/loss/depth_loss.hpp>
#include <gart/optim/rows.hpp>
#include <gart/train/options.hpp>

#include <functional>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// One of a step's images, where it is traced.
struct step_view {
  std::size_t index = 0;                   ///< of the training views
  int step = 0, iterations = 0;            ///< images before it, and of the run
  int shrink = 1;                          ///< pixels of the photograph to one of the image, across and down
  camera seen = {}, captured = {};         ///< as it is traced, and as the capture has it; of the image's size
  truth_view truth = {};                   ///< the photograph
  span<float const> color = {};            ///< [H][W][3]
  depth_pixels depth = {};                 ///< where a part asked for it; gradients of a strategy with_depth alone
  image_gradients by_image = {};           ///< dL/d image
  render_options options = {};             ///< that it is traced by
  gaussians_view<float const> model = {};  ///< that it is traced of, on this rank
  int degree = 0;                          ///< of the bands that are evaluated
  gaussians_view<float> gradients = {};    ///< after_backward on one rank: of Gaussians, to add to
  std::function<void(float*)> share = {};  ///< fills in what others have traced of an image of one float a pixel
};

/// What a part asks of a step.
struct part_needs {
  bool image = false;      ///< the whole image on each rank that traces it
  bool depth = false;      ///< its depth and transmittance too
  bool gradients = false;  ///< dL/d Gaussians by each view alone
};

/// What a run has learned of its photographs' colours.
struct learned_colors {
  std::vector<view_exposure> views;    ///< exposures
  std::vector<lens_falloff> falloffs;  ///< of lenses
};

/// The cameras of the training views.
inline std::vector<named_camera> training_cameras(dataset const& data) {
  std::vector<named_camera> all;
  for (dataset_view const& v : data.train) all.push_back({v.name, v.view});
  return all;
}

/// One that learns nothing. Frame: of the trainer.
template <class Frame>
class learned_part {
 public:
  using execution_type = typename Frame::execution_type;  ///< the policy
  learned_part() = default;
  virtual ~learned_part() = default;

  /// Floats that an image gives.
  virtual std::size_t numbers() const { return 0; }
  /// Of a step that begins after so many images.
  virtual part_needs needs(std::size_t /*view*/, int /*step*/, int /*iterations*/) const { return {}; }
  /// Whether it changes cameras.
  virtual bool moves_cameras() const { return false; }
  /// The camera of a training view as it is learned.
  virtual camera view(std::size_t /*index*/, camera const& as_known) const { return as_known; }
  /// Any camera of the capture.
  virtual camera through(camera const& as_known) const { return as_known; }
  /// The image as this part shows it, until the next call.
  virtual span<float const> before_loss(step_view const&, span<float const> image, span<float> /*numbers*/) {
    return image;
  }
  /// Of the error of each pixel, by which densification grows Gaussians: where those of the frame are not to blame.
  virtual void leave_out(span<float> /*error*/) {}
  /// Turns the gradient by what before_loss gave to that by what it was given.
  virtual void after_loss(step_view const&, span<float> /*gradient*/, span<float> /*numbers*/) {}
  /// `frame`: null on a rank that has no rows of the image.
  virtual void after_backward(Frame* /*frame*/, step_view const&, span<float> /*numbers*/) {}
  /// Of this rank's rows.
  virtual void after_gradients(gaussians_view<float const> const& /*model*/,
                               gaussians_view<float const> const& /*gradients*/, camera const& /*seen*/,
                               all_rows<execution_type>& /*rows*/, span<float> /*numbers*/) {}
  /// Whether images of the model show more than the Gaussians, by show().
  virtual bool shows() const { return false; }
  /// Into an image of the Gaussians, [H][W][3] in memory of the policy.
  virtual void show(camera const& /*view*/, render_options /*options*/, gaussians_view<float const> /*model*/,
                    int /*degree*/, span<float> /*image*/) {}
  /// The numbers, in host memory.
  virtual void found(step_view const&, span<float> /*numbers*/) {}
  /// What they add to the loss that is reported.
  virtual float loss(span<float const> /*numbers*/) const { return 0; }
  /// After the optimizer, for each image of the step in order. `step`: images before it.
  virtual void step(std::size_t /*view*/, int /*shrink*/, span<float const> /*numbers*/, int /*step*/,
                    int /*iterations*/, learning_rates const&) {}
  virtual void save(named_arrays&) const {}    ///< what the next step depends on
  virtual void load(named_arrays const&) {}    ///< from a state
  virtual void tell(learned_colors&) const {}  ///< what it has learned, for files
};

}}  // namespace gart::GART_ISA
