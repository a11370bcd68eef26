#pragma once
/// \file
/// The buffers of a step's image: colours, their gradient and the numbers that the image gives. They are kept from step
/// to step. Memory: 24 bytes a pixel; 4 more for each of depth, transmittance, their gradients, and errors, where
/// needed.

#include <gart/backward/backward.hpp>
#include <gart/loss/depth_loss.hpp>
#include <gart/loss/error_map.hpp>
#include <gart/loss/image_loss.hpp>

namespace gart { inline namespace GART_ISA {

/// An image in a policy's memory, and its loss.
template <execution E>
struct step_image {
  buffer<float, E> color, by_color;  ///< [H][W][3], and its gradient
  buffer<float, E> error;            ///< [H][W], where densification needs it; else empty
  image_loss<E> loss;                ///< with its buffers
  buffer<float, E> numbers;  ///< a row for each image of the step: loss, mean squared error, and the parts' numbers

  /// Allocates nothing; `exec` must outlive it.
  explicit step_image(E& exec)
      : color(exec),
        by_color(exec),
        error(exec),
        loss(exec),
        numbers(exec),
        depth_(exec),
        transmittance_(exec),
        by_depth_(exec),
        by_transmittance_(exec) {}

  /// Begins an image of so many pixels; gradients by depth start at zero.
  image_targets begin(std::size_t pixels, bool with_depth, bool with_depth_gradients) {
    color.resize(3 * pixels), by_color.resize(3 * pixels);
    std::size_t const deep = with_depth ? pixels : 0, by_deep = with_depth_gradients ? pixels : 0;
    depth_.resize(deep), transmittance_.resize(deep), by_depth_.resize(by_deep), by_transmittance_.resize(by_deep);
    if (by_deep) by_depth_.zero(), by_transmittance_.zero();
    image_targets targets;
    targets.color = color.data();
    if (deep) targets.depth = depth_.data(), targets.transmittance = transmittance_.data();
    return targets;
  }
  /// Depth and transmittance of the current image.
  depth_pixels depth() { return {depth_, transmittance_, by_depth_, by_transmittance_}; }
  /// Gradients of the current image.
  image_gradients gradients() const { return {by_color, by_depth_, by_transmittance_}; }

 private:
  buffer<float, E> depth_, transmittance_, by_depth_, by_transmittance_;
};

}}  // namespace gart::GART_ISA
