#pragma once
/// \file
/// One model and one tree over it for any number of renderers, in one copy:
///
///   auto const model = make_shared_model(request, gaussians, options, position);
///   std::thread one([&] {
///     auto const renderer = make_renderer(request);         // each thread its own
///     renderer->share_model(model);
///     traced_rays const seen = renderer->trace(rays, options);
///   });
///
/// The rule of threads: a renderer, and what it made (contexts), is used by one thread at a time. A shared model never
/// changes and is only read, by any number of renderers and threads at once. Any thread may copy and drop the handle.
/// The memory goes with the last handle. A renderer keeps one until it is given another model or ends, and waits for
/// its own work first.
///
/// Batches are traced by the shared tree where they have its options.alpha_min, else by a tree of the renderer's own.
/// Hits are the same bits. Views read the Gaussians and make what their tracer needs.
///
/// Cost: a copy of the model and a tree, once (rays/shared_index.hpp). Errors: unsupported as make_renderer, and where
/// batches of rays are not compiled. Also invalid_argument for a model of another SH degree than the request's. The
/// call renderer.share_model throws it for a handle of another backend, device, SH degree, kernel degree or instruction
/// set.

#include <gart/channels/targets.hpp>
#include <gart/render/options.hpp>
#include <gart/runtime/request.hpp>
#include <gart/scene/gaussians.hpp>

#include <memory>

namespace gart {

/// The handle; what it holds is for renderers.
class shared_model {
 public:
  /// Frees the memory, and the policy that it was made by.
  virtual ~shared_model() = default;
  /// What it was made for.
  virtual configuration_request const& request() const = 0;
  /// That it was compiled for; empty on a device.
  virtual char const* compiled_for() const = 0;
  /// In memory of the policy, read only.
  virtual gaussians_view<float const> gaussians() const = 0;
  /// Their features; width 0: none.
  virtual gaussian_channels channels() const = 0;
  /// Bytes of the policy's memory.
  virtual std::size_t bytes() const = 0;
};

/// Copies a model and builds its tree, for the backend, the device and the degrees of a request. The request's tracer,
/// method, stream and threads may differ from a renderer's. `frame`: a point of the world near which most rays begin.
std::shared_ptr<shared_model const> make_shared_model(configuration_request const& request, gaussian_model const& model,
                                                      render_options const& options = {},
                                                      vec3d const& frame = vec3d(0.0));

}  // namespace gart
