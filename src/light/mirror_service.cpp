// Which mirrors are compiled.
#include <gart/core/error.hpp>
#include <gart/light/mirror_service.hpp>

#include <algorithm>
#include <vector>

namespace gart {

namespace {

struct entry {
  std::string policy, instruction_set;
  int kernel_degree;
  mirror_service_maker make;
};

std::vector<entry>& entries() {
  static std::vector<entry> all;
  return all;
}

std::string as_text(std::string const& policy, std::string const& instruction_set, int kernel_degree) {
  return policy + (instruction_set.empty() ? "" : " (" + instruction_set + ")") + ", kernel degree " +
         std::to_string(kernel_degree);
}

}  // namespace

void register_mirrors(std::string const& policy, std::string const& instruction_set, int kernel_degree,
                      mirror_service_maker make) {
  entries().push_back({policy, instruction_set, kernel_degree, make});
}

std::unique_ptr<mirror_service> make_mirrors(std::string const& policy, std::string const& instruction_set,
                                             int kernel_degree, void* exec, light::scene const& scene) {
  light::require_scene(scene);
  if (std::none_of(scene.materials.begin(), scene.materials.end(),
                   [](auto const& m) { return m.kind == light::material_kind::mirror; }))
    throw invalid_argument("dataset.mirrors: no material of the scene is a mirror");
  std::string there;
  for (entry const& e : entries()) {
    if (e.policy == policy && e.instruction_set == instruction_set && e.kernel_degree == kernel_degree)
      return e.make(exec, scene);
    there += (there.empty() ? "" : "; ") + as_text(e.policy, e.instruction_set, e.kernel_degree);
  }
  throw unsupported("mirrors are not compiled for policy " + as_text(policy, instruction_set, kernel_degree) +
                    "; there are: " + there +
                    ". A program compiles others with register_paths: gart/runtime/compiled_paths.hpp");
}

}  // namespace gart
