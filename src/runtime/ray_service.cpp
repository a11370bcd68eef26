// Which services trace batches of rays and place instances, and which one a renderer takes.
#include <gart/core/error.hpp>
#include <gart/runtime/instances.hpp>
#include <gart/runtime/model_arrays.hpp>
#include <gart/runtime/ray_service.hpp>

#include <string>
#include <utility>
#include <vector>

namespace gart {

namespace {

struct entry {
  backend_kind backend;
  int kernel_degree;
  ray_service_maker make;
  shared_model_maker share;
};

std::vector<entry>& services() {
  static std::vector<entry> all;
  return all;
}

std::vector<std::pair<backend_kind, instance_scene_maker>>& scenes() {
  static std::vector<std::pair<backend_kind, instance_scene_maker>> all;
  return all;
}

std::string as_text(backend_kind backend, int kernel_degree) {
  return std::string(to_string(backend)) + ", kernel degree " + std::to_string(kernel_degree);
}

entry const& service_of(configuration_request const& request) {
  std::string there;
  for (entry const& e : services()) {
    if (e.backend == request.backend && e.kernel_degree == request.kernel_degree) return e;
    there += (there.empty() ? "" : "; ") + as_text(e.backend, e.kernel_degree);
  }
  throw unsupported("batches of rays are not compiled for backend " + as_text(request.backend, request.kernel_degree) +
                    "; there are: " + there +
                    ". A program compiles others with register_rays: gart/runtime/compiled_rays.hpp");
}

}  // namespace

void register_ray_service(backend_kind backend, int kernel_degree, ray_service_maker make, shared_model_maker share) {
  services().push_back({backend, kernel_degree, make, share});
}

std::unique_ptr<ray_service> make_ray_service(configuration_request const& request) {
  return service_of(request).make(request);
}

std::shared_ptr<shared_model const> make_shared_model(configuration_request const& request, gaussian_model const& model,
                                                      render_options const& options, vec3d const& frame) {
  configuration_request found = request;
  found.backend = resolve(request).backend;
  require_options(options);
  require_arrays(model, "make_shared_model");
  if (model.sh_degree != request.sh_degree)
    throw invalid_argument("make_shared_model: the model is of SH degree " + std::to_string(model.sh_degree) +
                           ", and configuration_request.sh_degree is " + std::to_string(request.sh_degree) +
                           ": make them the same");
  for (int k = 0; k < 3; ++k)
    if (!(frame[k] - frame[k] == 0)) throw invalid_argument("make_shared_model: the frame is not finite");
  return service_of(found).share(found, model, options, frame);
}

void register_instances(backend_kind backend, instance_scene_maker make) { scenes().emplace_back(backend, make); }

std::unique_ptr<instance_scene> make_instances(configuration_request const& request) {
  std::string there;
  for (auto const& [backend, make] : scenes()) {
    if (backend == request.backend) return make(request);
    there += (there.empty() ? "" : ", ") + std::string(to_string(backend));
  }
  throw unsupported("scenes of instances are not compiled for backend " + std::string(to_string(request.backend)) +
                    "; there are: " + there + ". Set configuration_request.backend to that of the renderer");
}

}  // namespace gart
