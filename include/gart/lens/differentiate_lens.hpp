#pragma once
/// \file
/// The gradient of a view's focal lengths and principal point, from that of its rays, by sums over the pixels:
///
///   differentiate(frame, pass, color_gradient, gradients);        // backward/backward.hpp, where it is wanted besides
///   lens_differentiation<E> by_lens(exec);
///   lens_gradient const g = by_lens(frame, color, {.color = color_gradient});
///
///   dL/d fx = sum over pixels of -x / fx (dL/d ray . d ray / d x),   dL/d cx = sum of -1 / fx (dL/d ray . d ray / d
///   x),
/// x = (u - cx) / fx, and so for y. dL/d ray is backward/differentiate_rays.hpp, d ray / d x the camera's own
/// (camera/lens_slopes.hpp). It holds for every tracer, any function of the image, and every camera with a focal
/// length.
///
/// Sums in double, in an order that depends on the number of pixels only. Cost: a trace of the view. Memory: 40 bytes a
/// pixel. Errors: invalid_argument for a camera without a focal length, and for a view with antialiasing. The sums do
/// not contain the filter's dependence on the focal length.

#include <gart/algorithm/reduce.hpp>
#include <gart/backward/differentiate_rays.hpp>
#include <gart/camera/models.hpp>

namespace gart { inline namespace GART_ISA {

/// dL/d focal lengths and principal point, in pixels.
struct lens_gradient {
  static constexpr int floats = 4;        ///< numbers
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< gradient by each
  ///@{
  /// Zero, or from four numbers in this order. `shrink`: how many times smaller their image was than the wanted one.
  lens_gradient() = default;
  explicit lens_gradient(float const* v, int shrink = 1)
      : fx(double{v[0]} / shrink), fy(double{v[1]} / shrink), cx(double{v[2]} / shrink), cy(double{v[3]} / shrink) {}
  ///@}
};

namespace lens_kernels {

// What each pixel adds: [4][H W].
template <class Slopes>
struct weigh_pixels {
  Slopes slopes;
  intrinsics focal;
  pixel_rays rays;
  vec3 const *by_direction, *by_origin;
  float* out;

  GART_KERNEL void operator()(index_t i) const {
    int const width = rays.view.width, x = static_cast<int>(i) % width, y = static_cast<int>(i) / width;
    std::size_t const pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(rays.view.height);
    float const u = static_cast<float>(x) + 0.5f, v = static_cast<float>(y) + 0.5f;
    ray_slopes const s = slopes(u, v, rays.of(x, y).direction);
    float const by_x = glm::dot(by_direction[i], s.direction_x) + glm::dot(by_origin[i], s.origin_x);
    float const by_y = glm::dot(by_direction[i], s.direction_y) + glm::dot(by_origin[i], s.origin_y);
    float const by_cx = -by_x / focal.fx, by_cy = -by_y / focal.fy;
    out[i] = by_cx * ((u - focal.cx) / focal.fx), out[pixels + i] = by_cy * ((v - focal.cy) / focal.fy);
    out[2 * pixels + i] = by_cx, out[3 * pixels + i] = by_cy;
  }
};

}  // namespace lens_kernels

/// Gradients of lenses, one view at a time, and the memory that they need.
template <execution E>
class lens_differentiation {
  // For a frame with all rows.
  struct alone {
    void operator()(float*) const {}
  };

 public:
  /// Allocates nothing; `exec` must outlive it.
  explicit lens_differentiation(E& exec)
      : exec_(&exec), by_direction_(exec), by_origin_(exec), parts_(exec), out_(exec) {}

  /// Writes a lens_gradient's numbers in order to out, [4] in the policy's memory. Other arguments: as
  /// differentiate_rays. Where the frame has some rows only, share(float* plane) fills in other ranks' rows of an image
  /// [H][W]. It is called once for each of the four numbers.
  template <class Frame, class Share = alone>
  void operator()(Frame& frame, span<float const> color, image_gradients const& image, span<float> out,
                  depth_image const& more = {}, Share&& share = {}) {
    if (frame.options().antialias > 0)
      throw invalid_argument(
          "differentiate_lens: the filter of the pixels has no gradient by the focal length: set "
          "render_options.antialias to 0");
    if (out.size() < lens_gradient::floats)
      throw invalid_argument("differentiate_lens: the gradient of a lens has four numbers");
    visit_camera(frame.view(), [&]<class M>(M const& model) {
      if constexpr (focal_camera<M>) {
        std::size_t const pixels = static_cast<std::size_t>(model.width) * static_cast<std::size_t>(model.height);
        by_direction_.resize(pixels), by_origin_.resize(pixels), parts_.resize(lens_gradient::floats * pixels);
        differentiate_rays(frame, color, image, {&by_direction_.data()->x, &by_origin_.data()->x}, more);
        stage_scope stage(*exec_, "lens");
        pixel_rays rays;
        frame.with_rays([&](auto const& own) { rays = {own.view, own.directions}; });
        parallel_for(*exec_, "lens/weigh", static_cast<index_t>(pixels),
                     lens_kernels::weigh_pixels<decltype(model.slopes())>{
                         model.slopes(), model.focal(), rays, by_direction_.data(), by_origin_.data(), parts_.data()});
        add_up(pixels, out, share);
      } else {
        throw invalid_argument(
            "differentiate_lens: the camera has no focal length and no principal point (equirectangular ones have "
            "none): leave its lens as it is");
      }
    });
  }

  /// The same on a rank that traced no row of the view; pixels: the image's.
  template <class Share>
  void of_others(std::size_t pixels, span<float> out, Share&& share) {
    parts_.resize(lens_gradient::floats * pixels);
    add_up(pixels, out, share);
  }

  /// Returns it to the host; waits for it.
  template <class Frame>
  lens_gradient operator()(Frame& frame, span<float const> color, image_gradients const& image,
                           depth_image const& more = {}) {
    out_.resize(lens_gradient::floats);
    (*this)(frame, color, image, out_.view(), more);
    return lens_gradient(out_.to_host().data());
  }

 private:
  template <class Share>
  void add_up(std::size_t pixels, span<float> out, Share&& share) {
    for (std::size_t k = 0; k < lens_gradient::floats; ++k) {
      share(parts_.data() + k * pixels);
      reduce(*exec_, span<float const>(parts_).subspan(k * pixels, pixels), out.subspan(k, 1));
    }
  }

  E* exec_;
  buffer<vec3, E> by_direction_, by_origin_;
  buffer<float, E> parts_, out_;
};

/// The same for a single call.
template <class Frame>
lens_gradient differentiate_lens(Frame& frame, span<float const> color, image_gradients const& image,
                                 depth_image const& more = {}) {
  return lens_differentiation<typename Frame::execution_type>(frame.exec())(frame, color, image, more);
}

}}  // namespace gart::GART_ISA
