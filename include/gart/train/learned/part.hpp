#pragma once
/// \file
/// Parts: what a training learns besides the Gaussians, or compares besides colours: exposures, vignetting, poses,
/// lenses, depth. A part derives from learned_part<Frame>, whose members do nothing. parts.hpp lists those of the
/// library; a program adds its own by trainer::learn. The calls in the order of a step, for each image on the ranks
/// that trace it:
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

#include <functional>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// One image of a step, on a rank that traces it.
struct step_view {
  std::size_t index = 0;                   ///< among the training views
  int step = 0, iterations = 0;            ///< images before it; images of the run
  int shrink = 1;                          ///< pixels of the photograph to one of the image, across and down
  camera seen = {}, captured = {};         ///< the camera that is traced, and the capture's; both of the image's size
  truth_view truth = {};                   ///< the photograph
  span<float const> color = {};            ///< [H][W][3]
  depth_pixels depth = {};                 ///< where a part needs it; gradients only with a method with_depth
  image_gradients by_image = {};           ///< dL/d image
  render_options options = {};             ///< that it is traced by
  gaussians_view<float const> model = {};  ///< that it is traced of, on this rank
  int degree = 0;                          ///< of the bands that are evaluated
  gaussians_view<float> gradients = {};    ///< after_backward on one rank: of Gaussians, to add to
  std::function<void(float*)> share = {};  ///< fills in the rows of other ranks, in an image of one float a pixel
};

/// A part's input from a step.
struct part_needs {
  bool image = false;      ///< the whole image on each rank that traces it
  bool depth = false;      ///< depth and transmittance too
  bool gradients = false;  ///< dL/d Gaussians by each view alone
};

/// The learned colour corrections of a run's photographs.
struct learned_colors {
  std::vector<view_exposure> views;    ///< of the views that steps have moved
  std::vector<lens_falloff> falloffs;  ///< of the lenses that steps have moved
};

/// The cameras of the training views.
inline std::vector<named_camera> training_cameras(dataset const& data) {
  std::vector<named_camera> all;
  for (dataset_view const& v : data.train) all.push_back({v.name, v.view});
  return all;
}

/// The base: learns nothing. Frame: the trainer's.
template <class Frame>
class learned_part {
 public:
  using execution_type = typename Frame::execution_type;  ///< the policy
  learned_part() = default;
  virtual ~learned_part() = default;

  /// Floats that this part gets from an image.
  virtual std::size_t numbers() const { return 0; }
  /// The needs of a step that begins after so many images.
  virtual part_needs needs(std::size_t /*view*/, int /*step*/, int /*iterations*/) const { return {}; }
  /// Whether it changes cameras.
  virtual bool moves_cameras() const { return false; }
  /// The learned camera of a training view.
  virtual camera view(std::size_t /*index*/, camera const& as_known) const { return as_known; }
  /// The learned camera for any camera of the capture.
  virtual camera through(camera const& as_known) const { return as_known; }
  /// The image as this part shows it, until the next call.
  virtual span<float const> before_loss(step_view const&, span<float const> image, span<float> /*numbers*/) {
    return image;
  }
  /// Takes away the error of pixels that Gaussians of the frame do not cause: densification grows by it.
  virtual void leave_out(span<float> /*error*/) {}
  /// Turns the gradient by before_loss's output into that by its input.
  virtual void after_loss(step_view const&, span<float> /*gradient*/, span<float> /*numbers*/) {}
  /// `frame`: null on a rank that has no rows of the image.
  virtual void after_backward(Frame* /*frame*/, step_view const&, span<float> /*numbers*/) {}
  /// Takes the gradients of this rank's rows.
  virtual void after_gradients(gaussians_view<float const> const& /*model*/,
                               gaussians_view<float const> const& /*gradients*/, camera const& /*seen*/,
                               all_rows<execution_type>& /*rows*/, span<float> /*numbers*/) {}
  /// Whether images of the model show more than the Gaussians, by show().
  virtual bool shows() const { return false; }
  /// Into an image of the Gaussians, [H][W][3] in memory of the policy.
  virtual void show(camera const& /*view*/, render_options /*options*/, gaussians_view<float const> /*model*/,
                    int /*degree*/, span<float> /*image*/) {}
  /// Takes the numbers, in host memory.
  virtual void found(step_view const&, span<float> /*numbers*/) {}
  /// The share of the numbers in the reported loss.
  virtual float loss(span<float const> /*numbers*/) const { return 0; }
  /// After the optimizer, for each image of the step in order. `step`: images before it.
  virtual void step(std::size_t /*view*/, int /*shrink*/, span<float const> /*numbers*/, int /*step*/,
                    int /*iterations*/, learning_rates const&) {}
  virtual void save(named_arrays&) const {}    ///< to a state
  virtual void load(named_arrays const&) {}    ///< from a state
  virtual void tell(learned_colors&) const {}  ///< adds its results, for files
};

}}  // namespace gart::GART_ISA
