// Which services trace batches of rays and place instances, and which one a renderer takes.
#include <gart/core/error.hpp>
#include <gart/runtime/instances.hpp>
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

}  // namespace

void register_ray_service(backend_kind backend, int kernel_degree, ray_service_maker make) {
  services().push_back({backend, kernel_degree, make});
}

std::unique_ptr<ray_service> make_ray_service(configuration_request const& request) {
  std::string there;
  for (entry const& e : services()) {
    if (e.backend == request.backend && e.kernel_degree == request.kernel_degree) return e.make(request);
    there += (there.empty() ? "" : "; ") + as_text(e.backend, e.kernel_degree);
  }
  throw unsupported("batches of rays are not compiled for backend " + as_text(request.backend, request.kernel_degree) +
                    "; there are: " + there +
                    ". A program compiles others with register_rays: gart/runtime/compiled_rays.hpp");
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
