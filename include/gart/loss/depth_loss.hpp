#pragma once
/// \file
/// The loss of an image's depth against a map of distances along the rays. Its gradients are by the rendered depth D
/// (the sum of w t) and the rendered transmittance T. With A = 1 - T, what a pixel sees is at the mean distance D / A,
/// and the loss is
///   L = scale / pixels * sum over pixels with a distance z > 0 of  A |D / A - z|,
/// where A weighs the pixel by how much of it is seen. A has no gradient of its own: seeing less would lower the loss.
/// So with s the sign of D / A - z
///   dL/dD = scale / pixels * s,   dL/dT = scale / pixels * s D / A,
/// both bounded, however little is seen. Pixels that the map does not know (0), that a mask excludes, or that see
/// nothing count nothing. One launch and a sum; 20 bytes a pixel.

#include <gart/algorithm/reduce.hpp>
#include <gart/exec/buffer.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/loss/image_loss.hpp>

namespace gart { inline namespace GART_ISA {

/// An image's depth, and where the gradients by it go: [H][W] each.
struct depth_pixels {
  span<float const> depth;             ///< sum of weight * t
  span<float const> transmittance;     ///< after the last hit
  span<float> depth_gradient;          ///< overwritten
  span<float> transmittance_gradient;  ///< overwritten
};

namespace detail {

struct depth_loss_kernel {
  depth_pixels image;
  float const* distance;
  truth_view truth;
  float scale;
  float* loss;
  GART_KERNEL void operator()(index_t pixel) const {
    float const z = distance[pixel], seen = 1.0f - image.transmittance[pixel];
    float by_depth = 0, by_transmittance = 0, error = 0;
    if (z > 0 && seen > 0 && truth.counts(pixel)) {
      float const mean = image.depth[pixel] / seen, off = mean - z;
      by_depth = off > 0 ? scale : off < 0 ? -scale : scale * off;  // a NaN stays one
      by_transmittance = by_depth * mean;
      error = scale * seen * fabsf(off);
    }
    image.depth_gradient[pixel] = by_depth, image.transmittance_gradient[pixel] = by_transmittance;
    loss[pixel] = error;
  }
};

}  // namespace detail

/// The loss, with the buffer that it needs.
template <execution E>
class depth_loss {
 public:
  /// No buffer is allocated yet.
  explicit depth_loss(E& exec) : exec_(&exec), pixels_(exec) {}

  /// distance: [H][W], in the policy's memory; of `truth` the mask alone is read. `loss` is a float of the policy's
  /// memory. scale: of a world unit.
  void evaluate(depth_pixels const& image, float const* distance, truth_view const& truth, float scale,
                span<float> loss) {
    pixels_.resize(image.depth.size());
    float const share = scale / static_cast<float>(image.depth.size());
    parallel_for(*exec_, "depth_loss", static_cast<index_t>(image.depth.size()),
                 detail::depth_loss_kernel{image, distance, truth, share, pixels_.data()});
    reduce(*exec_, span<float const>(pixels_), loss);
  }

 private:
  E* exec_;
  buffer<float, E> pixels_;
};

}}  // namespace gart::GART_ISA
