#pragma once
/// \file
/// Rendering and its gradients behind one host-safe interface, by a configuration that is chosen at run time.
///
/// The Gaussians are the renderer's own copy (set_model), or lie in the caller's memory (bind). Images and gradients
/// come to the host (render, differentiate), or stay where they are computed (render_to, differentiate_into). The
/// latter calls copy nothing, and go to the configuration's queue or to the stream that the request names. On a device
/// they return before the work is done. Use wait(), or the same stream, to come after it.
///
/// Memory "of the policy" is device memory of the request's device for cuda, host memory for the others.
///
/// A renderer, with its contexts, serves one thread at a time.
///
/// Every renderer also traces batches of any rays (rays/ray_batch.hpp). A call of forward() keeps the data for the
/// gradient of a view or of a batch. Any number of contexts may wait.
///
/// Errors: unsupported where no compiled configuration meets the request, naming what rules all out and how to compile
/// one. Also invalid_argument for Gaussians of another SH degree, for arrays that disagree in size, and for options out
/// of range. The same for options.rebuild_every with a tracer that builds no tree. Also out_of_memory, and other errors
/// of the policy.

#include <gart/exec/profile.hpp>
#include <gart/pose/pose.hpp>
#include <gart/render/options.hpp>
#include <gart/render/rendered.hpp>
#include <gart/runtime/forward_context.hpp>
#include <gart/runtime/request.hpp>
#include <gart/runtime/shared_model.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>

#include <memory>

namespace gart {

/// The arrays that a view is written to, in memory of the policy; null where one is not wanted.
struct render_targets {
  float* color = nullptr;          ///< [H][W][3], background composited
  float* transmittance = nullptr;  ///< [H][W]
  float* depth = nullptr;          ///< [H][W]: sum of weight * t
  u32* hits = nullptr;             ///< [H][W]: hits composited
  u8* rgba = nullptr;              ///< [H][W][4]: the colour in 8 bits a channel, for a screen or an encoder
  channel_targets channels = {};   ///< features
};

/// Renders and differentiates views of one model.
class renderer {
 public:
  /// Frees its memory of the policy.
  virtual ~renderer() = default;

  /// Copies the model, with its features; bound arrays are no longer used.
  virtual void set_model(gaussian_model const& model) = 0;
  /// Reads a model that other renderers read too, with its features and its tree (runtime/shared_model.hpp).
  virtual void share_model(std::shared_ptr<shared_model const> model) = 0;
  /// The arrays, in memory of the policy, must stay until another model is set or bound. Values written to them between
  /// two views count for the second, on the same stream.
  virtual void bind(gaussians_view<float const> parameters) = 0;

  /// Features in memory of the policy, in place of the model's own. They must stay until others are bound, or another
  /// model is set or bound. Values written to them between two views count for the second. Errors: invalid_argument
  /// where they are not of each Gaussian, or more than 512.
  virtual void bind_channels(gaussian_channels const& channels) = 0;

  /// A view to host memory; its features too where they are asked for, and there are any.
  virtual rendered render(camera const& view, render_options const& options, bool with_features = false) = 0;
  /// The view's colours as to_8bit makes them, [H][W][3]. The policy converts them, so 3 bytes a pixel are copied in
  /// place of 24.
  virtual image8 render_8bit(camera const& view, render_options const& options) = 0;
  /// A view to memory of the policy.
  virtual void render_to(camera const& view, render_options const& options, render_targets const& targets) = 0;

  /// The forward and the backward pass of a view by the configuration's method, for dL/dcolour [H][W][3]. The
  /// gradients stay where the policy computes until they are fetched. The profiler's stage "gradients" holds both
  /// passes and their preparation. Errors: invalid_argument for a gradient of another size than the view.
  virtual void differentiate(camera const& view, render_options const& options, image_float const& color_gradient) = 0;
  virtual gaussian_model gradients() const = 0;  ///< dL/d every parameter, of the last differentiate
  /// The same from and into memory of the policy: dL/dcolour is [H][W][3]. The gradients, of the Gaussians' number and
  /// SH degree, are overwritten. `targets` takes the view besides.
  virtual void differentiate_into(camera const& view, render_options const& options, float const* color_gradient,
                                  gaussians_view<float> gradients, render_targets const& targets = {}) = 0;
  /// dL/d the pose of the view of the last differentiate. Waits for it. Errors: invalid_argument before the first
  /// differentiate, after another view or model, and for a model without Gaussians.
  virtual pose_gradient differentiate_pose() = 0;

  /// Renders a view as render_to, and keeps a frame and a hit buffer for its gradients. The renderer reuses them for
  /// later contexts.
  virtual std::unique_ptr<forward_context> forward(camera const& view, render_options const& options,
                                                   render_targets const& targets) = 0;
  /// Traces a batch as trace_to, and keeps the data for its gradients.
  virtual std::unique_ptr<forward_context> forward(ray_batch const& rays, render_options const& options,
                                                   batch_targets const& targets,
                                                   gradient_form form = gradient_form::primitive) = 0;

  /// What rays see, from and to host memory. options.antialias must be 0. The tree is built for the first batch of a
  /// model, and again where bound arrays have changed. Errors: unsupported where batches are not compiled for the
  /// backend and the kernel degree.
  virtual traced_rays trace(ray_batch const& rays, render_options const& options, bool with_features = false) = 0;
  /// The same in memory of the policy. Waits for it to check the rays.
  virtual void trace_to(ray_batch const& rays, render_options const& options, batch_targets const& targets) = 0;
  /// All hits of rays in order, up to where options end a ray: transmittance_min = 0 lists every one. From and to host
  /// memory.
  virtual hit_lists list_hits(ray_batch const& rays, render_options const& options) = 0;

  virtual void wait() = 0;  ///< until all that was asked for is done

  /// Times of stages; waits for the policy.
  virtual profiler& profile() = 0;
  /// Most bytes of the policy's memory that were in use at a time.
  virtual std::size_t peak_bytes() const = 0;
  virtual std::size_t hit_buffer_bytes() const = 0;  ///< of the last differentiate; 0 where the method records nothing
  /// The configuration chosen for the request.
  virtual configuration_info configuration() const = 0;
};

/// The best configuration that meets the request.
std::unique_ptr<renderer> make_renderer(configuration_request const& request);

}  // namespace gart
