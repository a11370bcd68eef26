#pragma once
/// \file
/// Batches of rays for renderers. One compiled service for each policy and response serves all tracers, methods and
/// SH degrees. A library registers its services when it is loaded. A program adds one for its own response by
/// register_rays (runtime/compiled_rays.hpp).

#include <gart/render/options.hpp>
#include <gart/runtime/forward_context.hpp>
#include <gart/runtime/request.hpp>
#include <gart/runtime/shared_model.hpp>

#include <memory>

namespace gart {

/// Traces batches for a renderer, with calls of the same names (runtime/renderer.hpp).
class ray_service {
 public:
  /// Frees its memory of the policy.
  virtual ~ray_service() = default;
  /// Sets the Gaussians, whose arrays must stay. Call again when they may have changed. Waits for the policy.
  virtual void set_scene(gaussians_view<float const> scene, int active_degree) = 0;
  /// A model whose tree batches are traced by where it is that of the Gaussians; null: none. It must stay until another
  /// is given.
  virtual void share(shared_model const* model) = 0;
  /// What these have besides, after set_scene.
  virtual void set_channels(gaussian_channels const& channels) = 0;
  /// From and to host memory.
  virtual traced_rays trace(ray_batch const& rays, render_options const& options, bool with_features) = 0;
  /// From and to host memory.
  virtual hit_lists list_hits(ray_batch const& rays, render_options const& options) = 0;
  /// In memory of the policy.
  virtual void trace_to(ray_batch const& rays, render_options const& options, batch_targets const& targets) = 0;
  /// In memory of the policy.
  virtual std::unique_ptr<forward_context> forward(ray_batch const& rays, render_options const& options,
                                                   batch_targets const& targets, gradient_form form) = 0;
  virtual void wait() = 0;                     ///< until all that was asked for is done
  virtual std::size_t peak_bytes() const = 0;  ///< most bytes in use at a time
};

/// Makes the service that a request asks for.
using ray_service_maker = std::unique_ptr<ray_service> (*)(configuration_request const&);
/// Makes a model for renderers that share it.
using shared_model_maker = std::shared_ptr<shared_model const> (*)(configuration_request const&, gaussian_model const&,
                                                                   render_options const&, vec3d const& frame);
/// Adds both to the table; before main, from static initialisers.
void register_ray_service(backend_kind backend, int kernel_degree, ray_service_maker make, shared_model_maker share);
/// For the backend, the kernel degree, the device, the stream and the threads of a request. Errors: unsupported, naming
/// those there are.
std::unique_ptr<ray_service> make_ray_service(configuration_request const& request);

}  // namespace gart
