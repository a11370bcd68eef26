#pragma once
/// \file
/// Exposures of the training views, learned with the Gaussians (exposure.hpp). Each is applied to the rendered image
/// before the loss. Adam moves the twelve numbers of the step's view. With x' the exposed image,
///   dL/dx = M^T dL/dx',   dL/dM = sum over pixels of dL/dx' (x, 1)^T.
///
/// The identity shows the scene's colours. Only the start at the identity keeps the views' mean exposure near it.
///
/// Adam's epsilon is 0.03, large beside the usual one. The loss is a mean over pixels, so a photograph a tenth too
/// bright gives gradients of a few tenths at any size. Smaller gradients come mostly from Gaussians that have not
/// settled. Adam alone would scale these up to whole steps.
///
/// Buffers and cost: those of adam_table.hpp, a copy of the image and another pass over it.

#include <gart/exposure/adam_table.hpp>
#include <gart/exposure/exposure.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct expose_kernel {
  exposure const* view;
  float const* image;
  float* exposed;
  GART_KERNEL void operator()(index_t pixel) const {
    float const* const x = image + std::size_t{3} * pixel;
    exposure const e = *view;
    for (int c = 0; c < 3; ++c) exposed[std::size_t{3} * pixel + c] = e.channel(c, x[0], x[1], x[2]);
  }
};

// A lane takes every lanes-th pixel, turns its gradient, and sums the exposure's gradient.
struct exposure_gradient_kernel {
  exposure const* view;
  float const* image;
  float* gradient;  // in: dL/dx', out: dL/dx
  index_t pixels, lanes = 0;
  float* sums = nullptr;  // [lanes][12]

  GART_KERNEL void operator()(index_t lane) const {
    exposure const e = *view;
    float sum[exposure::floats] = {};
    for (index_t pixel = lane; pixel < pixels; pixel += lanes) {
      float const* const x = image + std::size_t{3} * pixel;
      float* const g = gradient + std::size_t{3} * pixel;
      float const d[3] = {g[0], g[1], g[2]};
      for (int c = 0; c < 3; ++c) {
        for (int k = 0; k < 3; ++k) sum[4 * c + k] = fma(d[c], x[k], sum[4 * c + k]);
        sum[4 * c + 3] += d[c];
        g[c] = fma(e.m[c], d[0], fma(e.m[4 + c], d[1], e.m[8 + c] * d[2]));
      }
    }
    for (int k = 0; k < exposure::floats; ++k) sums[std::size_t{exposure::floats} * lane + k] = sum[k];
  }
};

}  // namespace detail

/// The exposures of a run, and Adam's moments of them.
template <execution E>
class exposure_training : public adam_table<E, exposure::floats> {
 public:
  /// An identity for each view.
  exposure_training(E& exec, std::size_t views)
      : base(exec, identities(views), epsilon), exec_(&exec), exposed_(exec) {}

  static constexpr float epsilon = 0.03f;  ///< Adam's

  /// Exposes the image [H][W][3] as the view's photograph; the result lasts until the next call.
  span<float const> expose(std::size_t view, span<float const> image) {
    exposed_.resize(image.size());
    parallel_for(*exec_, "expose", static_cast<index_t>(image.size() / 3),
                 detail::expose_kernel{of(view), image.data(), exposed_.data()});
    return exposed_;
  }

  /// Turns dL/d exposed into dL/d image, and takes Adam's step for the view.
  void step(std::size_t view, span<float const> image, span<float> gradient, float rate) {
    differentiate(view, image, gradient);
    this->move(view, rate);
  }

  /// The first half of a step: turns dL/d exposed into dL/d image. The exposure's gradient, [12], lasts until the next
  /// call.
  span<float const> differentiate(std::size_t view, span<float const> image, span<float> gradient) {
    return this->sum("exposure_gradient", detail::exposure_gradient_kernel{of(view), image.data(), gradient.data(),
                                                                           static_cast<index_t>(image.size() / 3)});
  }

 private:
  using base = adam_table<E, exposure::floats>;
  static std::vector<float> identities(std::size_t views) {
    exposure const identity;
    std::vector<float> all;
    for (std::size_t v = 0; v < views; ++v) all.insert(all.end(), identity.m, identity.m + exposure::floats);
    return all;
  }
  exposure const* of(std::size_t view) { return reinterpret_cast<exposure const*>(this->at(view)); }

  E* exec_;
  buffer<float, E> exposed_;
};

}}  // namespace gart::GART_ISA
