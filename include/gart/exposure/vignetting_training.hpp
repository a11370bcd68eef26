#pragma once
/// \file
/// The falloffs of a capture's lenses, learned with the Gaussians (vignetting.hpp). Each is applied to the rendered
/// image before its exposure. Adam moves the nine numbers of the step's lens. With x' the shaded image, for each
/// channel
///   dL/dx = V dL/dx',   dL/dk_j = sum over pixels of u^(j + 1) x dL/dx'.
///
/// Buffers and cost: those of adam_table.hpp.

#include <gart/core/error.hpp>
#include <gart/exposure/adam_table.hpp>
#include <gart/exposure/vignetting.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct vignetting_map {
  using row = vignetting;
  static constexpr char const *label = "shade", *gradient_label = "vignetting_gradient";
  static constexpr float epsilon = adam_options::epsilon;
  static constexpr bool centred = false;
  image_circle circle;
  index_t width;

  explicit vignetting_map(camera const& c) : circle(c), width(static_cast<index_t>(c.width)) {}
  GART_HD float square(index_t pixel) const {
    index_t const y = pixel / width, x = pixel - y * width;
    return circle.square(static_cast<float>(x), static_cast<float>(y));
  }
  GART_HD void apply(vignetting const& falloff, index_t pixel, float const* x, float* shaded) const {
    float const u = square(pixel);
    for (int c = 0; c < 3; ++c) shaded[c] = falloff.gain(c, u) * x[c];
  }
  // g: in dL/dx', out dL/dx. Adds to the sum of dL/dk.
  GART_HD void differentiate(vignetting const& falloff, index_t pixel, float const* x, float* g, float* sum) const {
    float const u = square(pixel);
    for (int c = 0; c < 3; ++c) {
      float by_gain = x[c] * g[c];
      for (int j = 0; j < vignetting::powers; ++j) by_gain *= u, sum[vignetting::powers * c + j] += by_gain;
      g[c] *= falloff.gain(c, u);
    }
  }
};

}  // namespace detail

/// The falloffs of a run, and Adam's moments of them.
template <execution E>
class vignetting_training : public adam_table<E, detail::vignetting_map> {
 public:
  /// For these views' lenses, without falloff at first. Errors: invalid_argument, naming the view, for a camera without
  /// a principal point.
  vignetting_training(E& exec, std::vector<named_camera> const& views)
      : vignetting_training(exec, lenses_of(views), views) {}

  /// Darkens the image [H][W][3] of a view by its lens; the result lasts until the next call. `captured`, here and
  /// below: the capture's camera of the view, for an image of that size.
  span<float const> shade(std::size_t view, camera const& captured, span<float const> image) {
    return this->apply(lens_of_[view], detail::vignetting_map(captured), image);
  }

  /// Turns dL/d shaded into dL/d image. The lens's gradient, [9], lasts until the next call.
  span<float const> differentiate(std::size_t view, camera const& captured, span<float const> image,
                                  span<float> gradient) {
    return base::differentiate(lens_of_[view], detail::vignetting_map(captured), image, gradient);
  }

  /// Adam's step of the view's lens by its gradient, in host memory.
  void move_lens_of(std::size_t view, span<float const> gradient, float rate) {
    this->move(lens_of_[view], gradient, rate);
  }

  /// A view through each lens.
  std::vector<camera> const& lenses() const { return lenses_; }

 private:
  using base = adam_table<E, detail::vignetting_map>;

  vignetting_training(E& exec, std::vector<camera> lenses, std::vector<named_camera> const& views)
      : base(exec, std::vector<float>(vignetting::floats * lenses.size())), lenses_(std::move(lenses)) {
    for (named_camera const& v : views) lens_of_.push_back(place_of(v.view, lenses_));
  }

  static std::size_t place_of(camera const& view, std::vector<camera> const& lenses) {
    auto const at = std::find_if(lenses.begin(), lenses.end(), [&](camera const& c) { return one_lens(c, view); });
    return static_cast<std::size_t>(at - lenses.begin());
  }
  static std::vector<camera> lenses_of(std::vector<named_camera> const& views) {
    std::vector<camera> lenses;
    for (named_camera const& v : views) {
      if (v.view.kind == camera_kind::equirectangular)
        throw invalid_argument("train_options.vignetting: view " + v.name +
                               " has no principal point that a falloff could go by (equirectangular); set it to false");
      if (place_of(v.view, lenses) == lenses.size()) lenses.push_back(v.view);
    }
    return lenses;
  }

  std::vector<camera> lenses_;
  std::vector<std::size_t> lens_of_;  // of each view, its place there
};

}}  // namespace gart::GART_ISA
