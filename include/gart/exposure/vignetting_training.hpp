#pragma once
/// \file
/// The falloffs of a capture's lenses, learned with the Gaussians (vignetting.hpp). Each is applied to the rendered
/// image before its exposure. Adam moves the nine numbers of the step's lens. With x' the shaded image, for each
/// channel
///   dL/dx = V dL/dx',   dL/dk_j = sum over pixels of u^(j + 1) x dL/dx'.
///
/// Buffers and cost: those of adam_table.hpp, a copy of the image and another pass over it.

#include <gart/core/error.hpp>
#include <gart/exposure/adam_table.hpp>
#include <gart/exposure/vignetting.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

namespace detail {

struct shade_kernel {
  vignetting const* lens;
  image_circle circle;
  index_t width;
  float const* image;
  float* shaded;
  GART_KERNEL void operator()(index_t pixel) const {
    index_t const y = pixel / width, x = pixel - y * width;
    float const u = circle.square(static_cast<float>(x), static_cast<float>(y));
    std::size_t const at = std::size_t{3} * pixel;
    for (int c = 0; c < 3; ++c) shaded[at + c] = lens->gain(c, u) * image[at + c];
  }
};

// A lane takes every lanes-th pixel.
struct vignetting_gradient_kernel {
  vignetting const* lens;
  image_circle circle;
  index_t width;
  float const* image;
  float* gradient;  // in: dL/dx', out: dL/dx
  index_t pixels, lanes = 0;
  float* sums = nullptr;  // [lanes][9]

  GART_KERNEL void operator()(index_t lane) const {
    vignetting const falloff = *lens;
    float sum[vignetting::floats] = {};
    for (index_t pixel = lane; pixel < pixels; pixel += lanes) {
      index_t const row = pixel / width, column = pixel - row * width;
      float const u = circle.square(static_cast<float>(column), static_cast<float>(row));
      float const* const x = image + std::size_t{3} * pixel;
      float* const g = gradient + std::size_t{3} * pixel;
      for (int c = 0; c < 3; ++c) {
        float by_gain = x[c] * g[c];
        for (int j = 0; j < vignetting::powers; ++j) by_gain *= u, sum[vignetting::powers * c + j] += by_gain;
        g[c] *= falloff.gain(c, u);
      }
    }
    for (int j = 0; j < vignetting::floats; ++j) sums[std::size_t{vignetting::floats} * lane + j] = sum[j];
  }
};

}  // namespace detail

/// The falloffs of a run, and Adam's moments of them.
template <execution E>
class vignetting_training : public adam_table<E, vignetting::floats> {
 public:
  /// For these views' lenses, without falloff at first. Errors: invalid_argument, naming the view, for a camera without
  /// a principal point.
  vignetting_training(E& exec, std::vector<named_camera> const& views)
      : vignetting_training(exec, lenses_of(views), views) {}

  /// Darkens the image [H][W][3] of a view by its lens; shaded() has it until the next call. `captured`, here and
  /// below: the capture's camera of the view, for an image of that size.
  span<float const> shade(std::size_t view, camera const& captured, span<float const> image) {
    shaded_.resize(image.size());
    parallel_for(*exec_, "shade", static_cast<index_t>(image.size() / 3),
                 detail::shade_kernel{of(view), image_circle(captured), static_cast<index_t>(captured.width),
                                      image.data(), shaded_.data()});
    return shaded_;
  }
  /// The last shaded image.
  span<float const> shaded() const { return shaded_; }

  /// Turns dL/d shaded into dL/d image, and takes Adam's step for the view's lens.
  void step(std::size_t view, camera const& captured, span<float const> image, span<float> gradient, float rate) {
    differentiate(view, captured, image, gradient);
    this->move(lens_of_[view], rate);
  }

  /// The first half of a step: turns dL/d shaded into dL/d image. The lens's gradient, [9], lasts until the next call.
  span<float const> differentiate(std::size_t view, camera const& captured, span<float const> image,
                                  span<float> gradient) {
    return this->sum("vignetting_gradient", detail::vignetting_gradient_kernel{
                                                of(view), image_circle(captured), static_cast<index_t>(captured.width),
                                                image.data(), gradient.data(), static_cast<index_t>(image.size() / 3)});
  }

  /// The second half, for another rank's view.
  void move_lens_of(std::size_t view, span<float const> gradient, float rate) {
    this->move(lens_of_[view], gradient, rate);
  }

  /// A view through each lens.
  std::vector<camera> const& lenses() const { return lenses_; }

 private:
  using base = adam_table<E, vignetting::floats>;

  vignetting_training(E& exec, std::vector<camera> lenses, std::vector<named_camera> const& views)
      : base(exec, std::vector<float>(vignetting::floats * lenses.size())),
        exec_(&exec),
        lenses_(std::move(lenses)),
        shaded_(exec) {
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
  vignetting const* of(std::size_t view) { return reinterpret_cast<vignetting const*>(this->at(lens_of_[view])); }

  E* exec_;
  std::vector<camera> lenses_;
  std::vector<std::size_t> lens_of_;  // of each view, its place there
  buffer<float, E> shaded_;
};

}}  // namespace gart::GART_ISA
