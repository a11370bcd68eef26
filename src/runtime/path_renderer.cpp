// Which path renderers there are, and which one a request means.
#include <gart/core/error.hpp>
#include <gart/runtime/path_renderer.hpp>

#include <string>
#include <vector>

namespace gart {

namespace {

struct entry {
  backend_kind backend;
  int kernel_degree;
  bool (*available)(std::string*);
  path_renderer_maker make;
};

std::vector<entry>& entries() {
  static std::vector<entry> all;
  return all;
}

}  // namespace

rendered depth_of(path_layers const& layers) {
  rendered out;
  out.depth = layers.depth, out.transmittance = layers.transmittance;
  for (std::size_t i = 0; i < layers.mesh.data.size(); ++i)
    if (layers.mesh.data[i] != no_number) out.transmittance.data[i] = 0;
  return out;
}

void register_path_renderer(backend_kind backend, int kernel_degree, bool (*available)(std::string*),
                            path_renderer_maker make) {
  entries().push_back({backend, kernel_degree, available, make});
}

std::unique_ptr<path_renderer> make_path_renderer(configuration_request const& request) {
  entry const* best = nullptr;
  std::string there, reason;
  for (entry const& e : entries()) {
    there += std::string(there.empty() ? "" : "; ") + to_string(e.backend) + ", kernel degree " +
             std::to_string(e.kernel_degree);
    bool const wanted = request.backend == backend_kind::automatic || request.backend == e.backend;
    if (!wanted || request.kernel_degree != e.kernel_degree) continue;
    std::string why;
    if (!e.available(&why))
      reason = std::string("backend ") + to_string(e.backend) + ": " + why +
               "; use configuration_request.backend = openmp, which needs no device";
    else if (!best || e.backend > best->backend)  // serial, openmp, cuda: the faster ones come last
      best = &e;
  }
  if (best) return best->make(request);
  if (!reason.empty()) throw unsupported(reason);
  throw unsupported(std::string("paths of light are not compiled for backend ") + to_string(request.backend) +
                    ", kernel degree " + std::to_string(request.kernel_degree) + "; there are: " + there +
                    ". A program compiles others with register_paths: gart/runtime/compiled_paths.hpp");
}

}  // namespace gart
