#pragma once
/// \file
/// Exposures of the training views, learned with the Gaussians (exposure.hpp). Each is applied to the rendered image
/// before the loss. Adam moves the twelve numbers of the step's view. With x' the exposed image,
///   dL/dx = M^T dL/dx',   dL/dM = sum over pixels of dL/dx' (x, 1)^T.
///
/// The identity shows the scene's colours, and the mean exposure of the views stays at it (adam_table.hpp). Nothing
/// else tells a bright scene from bright exposures, and a model is looked at without them.
///
/// Adam's epsilon is 0.03, large beside the usual one. The loss is a mean over pixels. So a photograph a tenth too
/// bright gives gradients of a few tenths at any size. Smaller gradients come mostly from Gaussians that have not
/// settled. Adam alone would scale these up to whole steps.
///
/// Buffers and cost: those of adam_table.hpp.

#include <gart/exposure/adam_table.hpp>
#include <gart/exposure/exposure.hpp>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct exposure_map {
  using row = exposure;
  static constexpr char const *label = "expose", *gradient_label = "exposure_gradient";
  static constexpr float epsilon = 0.03f;
  static constexpr bool centred = true;

  GART_HD void apply(exposure const& e, index_t, float const* x, float* exposed) const {
    for (int c = 0; c < 3; ++c) exposed[c] = e.channel(c, x[0], x[1], x[2]);
  }
  // g: in dL/dx', out dL/dx. Adds to the sum of dL/dM.
  GART_HD void differentiate(exposure const& e, index_t, float const* x, float* g, float* sum) const {
    float const d[3] = {g[0], g[1], g[2]};
    for (int c = 0; c < 3; ++c) {
      for (int k = 0; k < 3; ++k) sum[4 * c + k] = fma(d[c], x[k], sum[4 * c + k]);
      sum[4 * c + 3] += d[c];
      g[c] = fma(e.m[c], d[0], fma(e.m[4 + c], d[1], e.m[8 + c] * d[2]));
    }
  }
};

}  // namespace detail

/// The exposures of a run, and Adam's moments of them.
template <execution E>
class exposure_training : public adam_table<E, detail::exposure_map> {
 public:
  /// An identity for each view.
  exposure_training(E& exec, std::size_t views) : base(exec, identities(views)) {}

  /// Exposes the image [H][W][3] as the view's photograph; the result lasts until the next call.
  span<float const> expose(std::size_t view, span<float const> image) { return this->apply(view, {}, image); }

  /// Turns dL/d exposed into dL/d image. The exposure's gradient, [12], lasts until the next call.
  span<float const> differentiate(std::size_t view, span<float const> image, span<float> gradient) {
    return base::differentiate(view, {}, image, gradient);
  }

 private:
  using base = adam_table<E, detail::exposure_map>;
  static std::vector<float> identities(std::size_t views) {
    exposure const identity;
    std::vector<float> all;
    for (std::size_t v = 0; v < views; ++v) all.insert(all.end(), identity.m, identity.m + exposure::floats);
    return all;
  }
};

}}  // namespace gart::GART_ISA
