#pragma once
// Rendering and its gradients behind one host-safe interface, by a configuration that is chosen at run time.
//
// Errors: unsupported, naming the configurations there are and how to compile one, for a configuration that is not;
// out_of_memory; whatever the policy throws.

#include <gart/exec/profile.hpp>
#include <gart/render/options.hpp>
#include <gart/render/rendered.hpp>
#include <gart/runtime/request.hpp>
#include <gart/scene/camera.hpp>
#include <gart/scene/gaussians.hpp>

#include <memory>

namespace gart {

class renderer {
 public:
  virtual ~renderer() = default;
  virtual void set_model(gaussian_model const& model) = 0;
  virtual rendered render(camera const& view, render_options const& options) = 0;
  // The forward and the backward pass of a view by the configuration's strategy, for dL/dcolour [H][W][3]. The
  // gradients stay where the policy computes until they are fetched. "gradients" is the profiler's stage of both passes
  // and of what prepares them. Errors: invalid_argument for a gradient of another size than the view.
  virtual void differentiate(camera const& view, render_options const& options, image_float const& color_gradient) = 0;
  virtual gaussian_model gradients() const = 0;  // dL/d every parameter, of the last differentiate
  virtual profiler& profile() = 0;
  virtual std::size_t peak_bytes() const = 0;
  virtual std::size_t lt_bytes() const = 0;  // of the last differentiate; 0 where the strategy records nothing
  virtual configuration_info configuration() const = 0;
};

std::unique_ptr<renderer> make_renderer(configuration_request const& request);

}  // namespace gart
