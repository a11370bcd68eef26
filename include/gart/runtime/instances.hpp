#pragma once
/// \file
/// Scenes of instances for renderers: models that stand at poses of their own, as one model to bind.
///
///   auto const actors = make_instances(request);                    // the request of the renderer
///   actors->set_models({street, car}, {{0}, {1, axes, position}});
///   renderer->bind(actors->scene());
///   renderer->render(view, options);                                // or trace, forward
///   actors->move(instances);                                        // poses have changed; what is bound stays
///
/// Work goes to the request's stream; without one, call wait() before the renderer's next call, and the renderer's
/// before backward(). What it does and costs: instances/instance_set.hpp, as the errors. unsupported where batches of
/// rays are not compiled for the backend.

#include <gart/instances/instance.hpp>
#include <gart/runtime/request.hpp>

#include <memory>
#include <vector>

namespace gart {

/// A scene on a policy.
class instance_scene {
 public:
  /// Frees its memory of the policy.
  virtual ~instance_scene() = default;
  /// Copies models from the host, with their features, and says what stands where.
  virtual void set_models(std::vector<gaussian_model> const& models, std::vector<instance> const& instances) = 0;
  /// The same of models in memory of the policy, whose arrays must stay. `features`: of each model, or none.
  virtual void bind_models(std::vector<gaussians_view<float const>> const& models,
                           std::vector<instance> const& instances,
                           std::vector<feature_view<float const>> const& features = {}) = 0;
  /// The same instances at other poses.
  virtual void move(std::vector<instance> const& instances) = 0;
  /// Again, from bound models that were written to.
  virtual void place_all() = 0;
  /// The scene, in memory of the policy, of the request's SH degree: to bind. It stays until models are set or bound.
  virtual gaussians_view<float const> scene() const = 0;
  /// Its features, to bind as channels; width 0: none.
  virtual feature_view<float const> features() const = 0;
  /// Whose Gaussian `id` of the scene is.
  virtual instance_gaussian of(u32 id) const = 0;
  /// From dL/d scene(), and of its features, to models and poses; all in memory of the policy.
  virtual void backward(gaussians_view<float const> by_scene, instance_gradients const& to,
                        feature_view<float const> by_features = {}) = 0;
  virtual void wait() = 0;  ///< until all that was asked for is done
};

/// Makes the scene that a request asks for.
using instance_scene_maker = std::unique_ptr<instance_scene> (*)(configuration_request const&);
/// Adds one to the table; before main, from static initialisers.
void register_instances(backend_kind backend, instance_scene_maker make);
/// For the backend, the SH degree, the device, the stream and the threads of a request.
std::unique_ptr<instance_scene> make_instances(configuration_request const& request);

}  // namespace gart
