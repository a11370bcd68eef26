#pragma once
/// \file
/// The renderer (runtime/renderer.hpp) of a policy, traits, a tracer and a strategy: a frame, a backward pass, and the
/// memory that a caller does not bring.

#include <gart/backward/backward.hpp>
#include <gart/pose/differentiate_pose.hpp>
#include <gart/render/render_image.hpp>
#include <gart/runtime/configuration_of.hpp>
#include <gart/runtime/registry.hpp>
#include <gart/scene/copy_bands.hpp>

#include <utility>

namespace gart { inline namespace GART_ISA {

/// A renderer of one configuration.
template <execution E, class Traits, class Tracer, strategy Strategy>
class compiled_renderer final : public renderer {
 public:
  static constexpr int sh_degree = Traits::sh_degree;  ///< that rows of coefficients have room for

  /// Makes the policy that the request asks for.
  explicit compiled_renderer(configuration_request const& request)
      : degree_(request.sh_degree),
        exec_(policy_of<E>(request)),
        frame_(exec_),
        pass_(exec_),
        model_(exec_, 0, sh_degree),
        gradients_(exec_, 0, sh_degree),
        bands_(exec_),
        band_gradients_(exec_),
        color_(exec_),
        color_gradient_(exec_),
        pose_backward_(exec_) {
    if (degree_ < 0 || degree_ > sh_degree)
      throw invalid_argument("renderer: configuration_request.sh_degree is past what this configuration stores");
  }

  void set_model(gaussian_model const& model) override {
    require_degree(model.sh_degree);
    degree_ == sh_degree ? model_.assign(model) : model_.assign(with_sh_degree(model, sh_degree));
    scene_ = std::as_const(model_).view();
    bound_bands_ = nullptr;
  }
  void bind(gaussians_view<float const> parameters) override {
    require_degree(parameters.sh_degree);
    scene_ = parameters;
    bound_bands_ = nullptr;
    if (degree_ == sh_degree) return;
    bound_bands_ = parameters.sh;
    bands_.resize(row_floats * parameters.count);
    scene_.sh = bands_.data(), scene_.sh_degree = sh_degree;
  }

  rendered render(camera const& view, render_options const& options) override {
    prepare(view, options);
    return render_image(frame_);
  }
  image8 render_8bit(camera const& view, render_options const& options) override {
    prepare(view, options);
    return render_image_8bit(frame_);
  }
  void render_to(camera const& view, render_options const& options, render_targets const& targets) override {
    prepare(view, options);
    image_targets const images = images_of(targets, targets.rgba != nullptr);
    frame_.render(images);
    if (targets.rgba) color_to_bytes(exec_, images.color, pixels_of(view), targets.rgba, 4);
  }

  void differentiate(camera const& view, render_options const& options, image_float const& color_gradient) override {
    if (color_gradient.data.size() != std::size_t{3} * pixels_of(view))
      throw invalid_argument("renderer: the colour's gradient must have three values for each pixel of the view");
    color_gradient_.assign(span<float const>(color_gradient.data.data(), color_gradient.data.size()));
    gradients_.resize_keep(scene_.count);
    differentiate_rows(view, options, color_gradient_.data(), gradients_.view(), {});
  }
  void differentiate_into(camera const& view, render_options const& options, float const* color_gradient,
                          gaussians_view<float> gradients, render_targets const& targets) override {
    if (degree_ == sh_degree) return differentiate_rows(view, options, color_gradient, gradients, targets);
    require_degree(gradients.sh_degree);
    gaussians_view<float> rows = gradients;
    band_gradients_.resize(row_floats * gradients.count);
    rows.sh = band_gradients_.data(), rows.sh_degree = sh_degree;
    differentiate_rows(view, options, color_gradient, rows, targets);
    copy_bands(exec_, rows.sh, sh_degree, gradients.sh, degree_, gradients.count);
  }
  pose_gradient differentiate_pose() override {
    if (gradients_.size() != scene_.count || scene_.count == 0)
      throw invalid_argument("renderer.differentiate_pose: call renderer.differentiate first");
    return pose_backward_(frame_, std::as_const(gradients_).view());
  }
  gaussian_model gradients() const override { return with_sh_degree(gradients_.to_host(), degree_); }
  void wait() override { exec_.synchronize(); }

  profiler& profile() override {
    exec_.synchronize();
    return exec_.profile;
  }
  std::size_t peak_bytes() const override { return exec_.memory.peak; }
  std::size_t lt_bytes() const override { return pass_.lt_bytes(); }
  configuration_info configuration() const override { return configuration_of<E, Traits, Tracer, Strategy>(degree_); }

 private:
  static index_t pixels_of(camera const& view) { return static_cast<index_t>(view.width) * view.height; }
  static constexpr std::size_t row_floats = std::size_t{3} * sh_coefficients(sh_degree);
  void require_degree(int degree) const {
    if (degree != degree_) throw invalid_argument("renderer: the model has another SH degree");
  }
  void prepare(camera const& view, render_options const& options) {
    require_tree(options.rebuild_every, from_string(Tracer::name, tracer_kind::own));
    if (bound_bands_) copy_bands(exec_, bound_bands_, degree_, bands_.data(), sh_degree, scene_.count);
    frame_.prepare(scene_, view, options, degree_);
  }
  // Into gradients in rows of sh_degree.
  void differentiate_rows(camera const& view, render_options const& options, float const* color_gradient,
                          gaussians_view<float> gradients, render_targets const& targets) {
    stage_scope stage(exec_, "gradients");
    prepare(view, options);
    if (!pass_.prepare(frame_)) throw pass_.out_of_memory_error();
    image_targets const images = images_of(targets, true);
    pass_.render(frame_, images);
    gart::differentiate(frame_, pass_, {color_gradient, std::size_t{3} * pixels_of(view)}, gradients);
    if (targets.rgba) color_to_bytes(exec_, images.color, pixels_of(view), targets.rgba, 4);
  }
  // The colour that something else is made of needs room, where the caller wants none.
  image_targets images_of(render_targets const& targets, bool needs_color) {
    image_targets images;
    images.color = targets.color, images.transmittance = targets.transmittance;
    images.depth = targets.depth, images.hits = targets.hits;
    if (needs_color && !images.color) {
      color_.resize(std::size_t{3} * pixels_of(frame_.view()));
      images.color = color_.data();
    }
    return images;
  }

  int degree_;  // of the model
  E exec_;
  frame<E, Traits, Tracer> frame_;
  backward_pass<frame<E, Traits, Tracer>, Strategy> pass_;
  gaussians<E> model_, gradients_;
  // Of Gaussians and of gradients that somebody else has, in rows of a lower degree.
  buffer<float, E> bands_, band_gradients_;
  float const* bound_bands_ = nullptr;
  gaussians_view<float const> scene_{.sh_degree = sh_degree};
  buffer<float, E> color_, color_gradient_;
  pose_differentiation<E> pose_backward_;
};

}}  // namespace gart::GART_ISA
