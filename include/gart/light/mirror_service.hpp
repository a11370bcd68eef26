#pragma once
/// \file
/// Mirrors that are known to be in a capture, as trainers meet them. They are compiled once a policy and response, and
/// found by the names of these (runtime/compiled_paths.hpp registers them). What they do: light/mirror_paths.hpp.
///
/// Errors: unsupported, naming those there are; invalid_argument for a scene without a mirror, or one that cannot be
/// traced.

#include <gart/core/span.hpp>
#include <gart/light/scene.hpp>
#include <gart/render/options.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>

#include <memory>

namespace gart {

/// The pixels of views that meet a mirror first. Images are [H][W][3], all in memory of the policy.
class mirror_service {
 public:
  /// The policy's memory goes with it.
  virtual ~mirror_service() = default;
  /// Those pixels of an image, others stay; of Gaussians whose arrays stay until backward.
  virtual void show(gaussians_view<float const> model, int active_degree, camera const& view,
                    render_options const& options, float* image) = 0;
  /// Zero at the pixels of the last show, of [H][W][3] or [H][W].
  virtual void take_out(span<float> image) = 0;
  /// Adds what dL/d those pixels comes to.
  virtual void backward(span<float const> by_image, gaussians_view<float> gradients) = 0;
};

/// On a policy, which is of the type that goes with the names.
using mirror_service_maker = std::unique_ptr<mirror_service> (*)(void* exec, light::scene const&);
/// Adds one to the table; before main, from static initialisers.
void register_mirrors(std::string const& policy, std::string const& instruction_set, int kernel_degree,
                      mirror_service_maker make);
/// The one of these names.
std::unique_ptr<mirror_service> make_mirrors(std::string const& policy, std::string const& instruction_set,
                                             int kernel_degree, void* exec, light::scene const& scene);

}  // namespace gart
