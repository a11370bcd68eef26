#pragma once
/// \file
/// A program's calls within a step of training: its own loss, and hooks between the step's parts.

#include <gart/exec/concepts.hpp>
#include <gart/io/dataset.hpp>
#include <gart/loss/depth_loss.hpp>
#include <gart/loss/image_loss.hpp>
#include <gart/optim/options.hpp>
#include <gart/scene/gaussians.hpp>
#include <gart/train/step_report.hpp>

#include <functional>

namespace gart { inline namespace GART_ISA {

/// The input of a loss: the rendered image and its view, in the policy's memory. It writes dL/d image and, into
/// value[0..1], the loss and the mean squared error.
template <execution E>
struct loss_input {
  E& exec;                   ///< the policy
  dataset_view const& view;  ///< the step's view, with the capture's camera
  truth_view truth;          ///< the photograph at the image's size, in the policy's memory
  int width, height;         ///< the image's size in pixels
  span<float const> image;   ///< [H][W][3]
  span<float> gradient;      ///< [H][W][3]
  span<float> value;         ///< [2]
  depth_pixels depth;        ///< to add to, for methods with_depth; else empty
};

/// A loss, called once a step. A function object: a template parameter would compile the trainer again for each loss.
template <execution E>
using loss_function = std::function<void(loss_input<E> const&)>;

/// A program's calls between the parts of a step; `step` counts the images before it. An empty hook costs nothing.
template <execution E>
struct training_hooks {
  std::function<void(learning_rates&, int step)> rates = {};  ///< changes the rates of a step
  /// Changes the complete gradients, penalties included; the number of Gaussians must stay.
  std::function<void(gaussians_view<float const> const& model, gaussians_view<float> const& gradients, int step)>
      before_optimizer = {};
  std::function<void(step_report const&)> after_step = {};  ///< the trainer may be changed
};

}}  // namespace gart::GART_ISA
