#pragma once
/// \file
/// The renderer (runtime/renderer.hpp) of a policy, traits, a tracer and a method. It holds a frame, a backward pass,
/// and memory for arrays that the caller does not give. Contexts of views have frames and passes of their own, which
/// the renderer lends and gets back.

#include <gart/backward/backward.hpp>
#include <gart/pose/differentiate_pose.hpp>
#include <gart/render/render_image.hpp>
#include <gart/runtime/configuration_of.hpp>
#include <gart/runtime/model_arrays.hpp>
#include <gart/runtime/ray_service.hpp>
#include <gart/runtime/registry.hpp>
#include <gart/runtime/shown_view.hpp>
#include <gart/scene/copy_bands.hpp>

#include <memory>
#include <utility>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// The renderer of one configuration.
template <execution E, class Traits, class Tracer, gradient_method Method>
class compiled_renderer final : public renderer {
 public:
  static constexpr int sh_degree = Traits::sh_degree;  ///< that rows of coefficients have room for

  /// Makes the policy that the request asks for.
  explicit compiled_renderer(configuration_request const& request)
      : request_(request),
        degree_(request.sh_degree),
        exec_(policy_of<E>(request)),
        frame_(exec_),
        pass_(exec_),
        model_(exec_, 0, sh_degree),
        gradients_(exec_, 0, sh_degree),
        bands_(exec_),
        band_gradients_(exec_),
        color_(exec_),
        color_gradient_(exec_),
        no_gradient_(exec_),
        channels_(exec_),
        pose_backward_(exec_) {
    if (degree_ < 0 || degree_ > sh_degree)
      throw invalid_argument("renderer: configuration_request.sh_degree is past what this configuration stores");
  }

  void set_model(gaussian_model const& model) override {
    require_degree(model.sh_degree);
    require_arrays(model);
    drop_shared();
    differentiated_ = 0, ++models_;
    degree_ == sh_degree ? model_.assign(model) : model_.assign(with_sh_degree(model, sh_degree));
    given_ = scene_ = std::as_const(model_).view();
    channels_.set_model(model);
    is_bound_ = false, bound_bands_ = nullptr;
  }
  void share_model(std::shared_ptr<shared_model const> model) override {
    require_shared(model.get(), configuration(), request_.device);
    bind(model->gaussians());
    bind_channels(model->channels());
    is_bound_ = false, shared_ = std::move(model);  // nobody writes to it
  }
  void bind(gaussians_view<float const> parameters) override {
    require_degree(parameters.sh_degree);
    require_arrays(parameters, "renderer.bind");
    drop_shared();
    differentiated_ = 0, ++models_;
    given_ = scene_ = parameters;
    channels_.bind({}, parameters.count);
    is_bound_ = true, bound_bands_ = nullptr;
    if (degree_ == sh_degree) return;
    bound_bands_ = parameters.sh;
    bands_.resize(row_floats * parameters.count);
    scene_.sh = bands_.data(), scene_.sh_degree = sh_degree;
  }

  void bind_channels(gaussian_channels const& channels) override {
    channels_.bind(channels, given_.count);
    channels_are_old_ = true;
  }

  rendered render(camera const& view, render_options const& options, bool with_features = false) override {
    prepare(frame_, view, options);
    rendered out = render_image(frame_);
    int const width = with_features ? channels_.now().features.width : 0;
    if (width == 0) return out;
    buffer<float, E> features(exec_, std::size_t{pixels_of(view)} * static_cast<std::size_t>(width));
    channels_.show(frame_, {features.data()}, false);
    out.features.width = view.width, out.features.height = view.height, out.features.channels = width;
    out.features.data = features.to_host();
    return out;
  }
  image8 render_8bit(camera const& view, render_options const& options) override {
    prepare(frame_, view, options);
    return render_image_8bit(frame_);
  }
  void render_to(camera const& view, render_options const& options, render_targets const& targets) override {
    require_channels(channels_.now(), targets.channels, "renderer.render_to");
    prepare(frame_, view, options);
    image_targets images = images_of(targets, targets.rgba != nullptr);
    bool const more = targets.channels.any();
    if (more) images.hits = channels_.hits().count(exec_, pixels_of(view));
    frame_.render(images);
    if (more && targets.hits) exec_.copy(targets.hits, images.hits, sizeof(u32) * pixels_of(view));
    if (more) channels_.show(frame_, targets.channels, true);
    if (targets.rgba) color_to_bytes(exec_, images.color, pixels_of(view), targets.rgba, 4);
  }

  void differentiate(camera const& view, render_options const& options, image_float const& color_gradient) override {
    if (color_gradient.data.size() != std::size_t{3} * pixels_of(view))
      throw invalid_argument("renderer: the colour's gradient must have three values for each pixel of the view");
    color_gradient_.assign(span<float const>(color_gradient.data.data(), color_gradient.data.size()));
    gradients_.resize_keep(scene_.count);
    differentiated_ = 0;
    differentiate_rows(view, options, color_gradient_.data(), gradients_.view(), {});
    differentiated_ = frame_.preparation();
  }
  void differentiate_into(camera const& view, render_options const& options, float const* color_gradient,
                          gaussians_view<float> gradients, render_targets const& targets) override {
    if (!color_gradient && view.width > 0)
      throw invalid_argument("renderer.differentiate_into: color_gradient is null; give dL/dcolour of the view");
    require_arrays(gradients, "renderer.differentiate_into");
    if (degree_ == sh_degree) return differentiate_rows(view, options, color_gradient, gradients, targets);
    require_degree(gradients.sh_degree);
    gaussians_view<float> rows = gradients;
    band_gradients_.resize(row_floats * gradients.count);
    rows.sh = band_gradients_.data(), rows.sh_degree = sh_degree;
    differentiate_rows(view, options, color_gradient, rows, targets);
    copy_bands(exec_, rows.sh, sh_degree, gradients.sh, degree_, gradients.count);
  }
  pose_gradient differentiate_pose() override {
    if (!differentiated_) throw invalid_argument("renderer.differentiate_pose: call renderer.differentiate first");
    if (differentiated_ != frame_.preparation())
      throw invalid_argument(
          "renderer.differentiate_pose: another view was rendered since renderer.differentiate; ask for the pose "
          "first, "
          "or differentiate again");
    if (scene_.count == 0)
      throw invalid_argument("renderer.differentiate_pose: the model has no Gaussians, and a pose no gradient by them");
    return pose_backward_(frame_, std::as_const(gradients_).view());
  }
  gaussian_model gradients() const override { return with_sh_degree(gradients_.to_host(), degree_); }

  std::unique_ptr<forward_context> forward(camera const& view, render_options const& options,
                                           render_targets const& targets) override {
    require_channels(channels_.now(), targets.channels, "renderer.forward");
    std::unique_ptr<shown_type> shown;
    if (!idle_.empty()) shown = std::move(idle_.back()), idle_.pop_back();
    if (!shown) shown = std::make_unique<shown_type>(exec_);
    prepare(shown->frame, view, options);
    shown->render(targets, channels_.now());
    return std::make_unique<view_context>(*this, std::move(shown));
  }
  std::unique_ptr<forward_context> forward(ray_batch const& rays, render_options const& options,
                                           batch_targets const& targets, gradient_form form) override {
    return std::make_unique<batch_context>(*this, this->rays().forward(rays, options, targets, form));
  }
  traced_rays trace(ray_batch const& rays, render_options const& options, bool with_features = false) override {
    return this->rays().trace(rays, options, with_features);
  }
  void trace_to(ray_batch const& rays, render_options const& options, batch_targets const& targets) override {
    this->rays().trace_to(rays, options, targets);
  }
  hit_lists list_hits(ray_batch const& rays, render_options const& options) override {
    return this->rays().list_hits(rays, options);
  }
  void wait() override {
    exec_.synchronize();
    if (rays_) rays_->wait();
  }

  profiler& profile() override {
    exec_.synchronize();
    return exec_.profile;
  }
  std::size_t peak_bytes() const override { return exec_.memory.peak + (rays_ ? rays_->peak_bytes() : 0); }
  std::size_t hit_buffer_bytes() const override { return pass_.hit_buffer_bytes(); }
  configuration_info configuration() const override { return configuration_of<E, Traits, Tracer, Method>(degree_); }

 private:
  using frame_type = frame<E, Traits, Tracer>;
  using pass_type = backward_pass<frame_type, Method>;
  using shown_type = shown_view<frame_type, pass_type>;

  class view_context final : public forward_context {
   public:
    view_context(compiled_renderer& owner, std::unique_ptr<shown_type> shown)
        : owner_(owner), shown_(std::move(shown)), model_(owner.models_) {}
    ~view_context() override { owner_.idle_.push_back(std::move(shown_)); }
    void backward(output_gradients const& by, gradient_targets const& to) override {
      owner_.require_model(model_);
      owner_.differentiate_shown(*shown_, by, to);
    }

   private:
    compiled_renderer& owner_;
    std::unique_ptr<shown_type> shown_;
    u64 model_;
  };

  class batch_context final : public forward_context {
   public:
    batch_context(compiled_renderer& owner, std::unique_ptr<forward_context> left)
        : owner_(owner), left_(std::move(left)), model_(owner.models_) {}
    void backward(output_gradients const& by, gradient_targets const& to) override {
      owner_.require_model(model_);
      if (to.gaussians.mean) owner_.require_targets(to.gaussians);
      owner_.rays();  // whether bound arrays have changed
      left_->backward(by, to);
    }

   private:
    compiled_renderer& owner_;
    std::unique_ptr<forward_context> left_;
    u64 model_;
  };

  void require_model(u64 model) const {
    if (model != models_)
      throw invalid_argument("forward_context.backward: another model was set or bound; call renderer.forward again");
  }
  void require_targets(gaussians_view<float> const& gradients) const {
    require_arrays(gradients, "forward_context.backward");
    require_degree(gradients.sh_degree);
  }
  // A shared model goes after what was asked for of it is done; there is none then.
  void drop_shared() {
    if (!shared_) return;
    wait();
    if (rays_) rays_->share(nullptr);
    given_ = scene_ = gaussians_view<float const>{.sh_degree = sh_degree};
    channels_.bind({}, 0), bound_bands_ = nullptr, ++models_;
    shared_.reset();
  }
  // The service, and the Gaussians in it.
  ray_service& rays() {
    if (!rays_) {
      configuration_request request = request_;
      request.backend = from_string(E::name, backend_kind::automatic);
      request.kernel_degree = Traits::response::degree;
      if constexpr (E::device) request.stream = exec_.stream();
      rays_ = make_ray_service(request);
    }
    bool const other = is_bound_ || rays_model_ != models_ || models_ == 0;
    if (other) rays_->share(shared_.get()), rays_->set_scene(given_, degree_);
    if (other || channels_are_old_) rays_->set_channels(channels_.now());
    rays_model_ = models_, channels_are_old_ = false;
    return *rays_;
  }
  void differentiate_shown(shown_type& shown, output_gradients const& by, gradient_targets const& to) {
    std::size_t const n = pixels_of(shown.frame.view());
    require_gradients(by, n, "forward_context.backward");
    if (to.rays.origins || to.rays.directions)
      throw invalid_argument("forward_context.backward: a view has no gradient_targets.rays; trace them as a batch");
    require_channels(shown.hits.channels, by.channels, to.channels, n, "forward_context.backward");
    // Features alone need no pass of the colours.
    if (!to.gaussians.mean && !to.pose) return channels_.pull(shown.frame, shown.hits, by.channels, to.channels);
    gaussians_view<float> rows = to.gaussians;
    bool const own = !rows.mean, narrow = !own && degree_ != sh_degree;
    if (own) {
      shown.gradients.resize_keep(scene_.count);
      rows = shown.gradients.view();
    } else {
      require_targets(rows);
    }
    if (narrow) {
      band_gradients_.resize(row_floats * rows.count);
      rows.sh = band_gradients_.data(), rows.sh_degree = sh_degree;
    }
    span<float const> color = by.color;
    if (color.empty()) {
      no_gradient_.resize(3 * n), no_gradient_.zero();
      color = no_gradient_;
    }
    output_gradients all = by;
    all.color = color;
    {
      stage_scope stage(exec_, "backward");
      shown.differentiate(all, rows, channels_);
    }
    if (narrow) copy_bands(exec_, rows.sh, sh_degree, to.gaussians.sh, degree_, rows.count);
    channels_.pull(shown.frame, shown.hits, by.channels, to.channels);
    if (to.pose) pose_backward_(shown.frame, rows, span<float>(to.pose, pose_gradient::floats));
  }

  static index_t pixels_of(camera const& view) { return static_cast<index_t>(view.width) * view.height; }
  static constexpr std::size_t row_floats = std::size_t{3} * sh_coefficients(sh_degree);
  void require_degree(int degree) const {
    if (degree != degree_) throw invalid_argument("renderer: the model has another SH degree");
  }
  void prepare(frame_type& frame, camera const& view, render_options const& options) {
    require_tree(options.rebuild_every, from_string(Tracer::name, tracer_kind::own));
    if (bound_bands_) copy_bands(exec_, bound_bands_, degree_, bands_.data(), sh_degree, scene_.count);
    frame.prepare(scene_, view, options, degree_);
  }
  // Into gradients in rows of sh_degree.
  void differentiate_rows(camera const& view, render_options const& options, float const* color_gradient,
                          gaussians_view<float> gradients, render_targets const& targets) {
    stage_scope stage(exec_, "gradients");
    prepare(frame_, view, options);
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

  std::shared_ptr<shared_model const> shared_;  // goes last: policies wait for what reads it
  configuration_request request_;
  int degree_;              // of the model
  u64 differentiated_ = 0;  // the frame's preparation that gradients_ are of; 0: they are of none
  E exec_;
  frame_type frame_;
  pass_type pass_;
  gaussians<E> model_, gradients_;
  // Of Gaussians and of gradients that somebody else has, in rows of a lower degree.
  buffer<float, E> bands_, band_gradients_;
  float const* bound_bands_ = nullptr;
  gaussians_view<float const> scene_{.sh_degree = sh_degree};
  gaussians_view<float const> given_{.sh_degree = sh_degree};  // in the rows that it came in
  bool is_bound_ = false;
  u64 models_ = 0;  // set or bound so far
  buffer<float, E> color_, color_gradient_, no_gradient_;
  view_channels<E, typename Traits::response> channels_;
  bool channels_are_old_ = false;  // of the service
  pose_differentiation<E> pose_backward_;
  std::vector<std::unique_ptr<shown_type>> idle_;  // of contexts that are gone
  std::unique_ptr<ray_service> rays_;
  u64 rays_model_ = 0;
};

}}  // namespace gart::GART_ISA
