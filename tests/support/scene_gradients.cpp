// Gradients of scene_by_kind.hpp.
#include <support/policies.hpp>
#include <support/trace_scene.hpp>

#include <optional>

namespace gart_test {

template <class E>
gart::gaussian_model scene_gradients(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                     gart::render_options const& options, int active_degree, tracer_kind kind,
                                     std::string const& method, std::vector<float> const& color_gradient,
                                     attributed_error* error) {
  std::optional<gart::gaussian_model> out;
  detail::with_degree(model.sh_degree, [&](auto degree) {
    auto const by = [&]<tracer_kind Kind, class Tracer>(std::integral_constant<tracer_kind, Kind>,
                                                        std::type_identity<Tracer>) {
      gradient_methods::with(method, [&]<class Method>(Method) {
        if constexpr (compiled_for<Method>(Kind, degree))
          out = gradients_by<degree, Method, Tracer>(exec, model, view, options, active_degree, color_gradient, error);
      });
    };
    if (kind == tracer_kind::bvh)
      by(std::integral_constant<tracer_kind, tracer_kind::bvh>{}, std::type_identity<gart::bvh_tracer<E>>{});
    if (kind == tracer_kind::tiles)
      by(std::integral_constant<tracer_kind, tracer_kind::tiles>{}, std::type_identity<gart::tile_tracer<E>>{});
#if defined(GART_WITH_EMBREE)
    if constexpr (!E::device)
      if (kind == tracer_kind::embree)
        by(std::integral_constant<tracer_kind, tracer_kind::embree>{}, std::type_identity<gart::embree_tracer<E>>{});
#endif
  });
  if (!out) throw std::runtime_error("not compiled here: " + method);
  return *out;
}

#define GART_TEST_GRADIENTS(E)                                                                                     \
  template gart::gaussian_model scene_gradients(E&, gart::gaussian_model const&, gart::camera const&,              \
                                                gart::render_options const&, int, tracer_kind, std::string const&, \
                                                std::vector<float> const&, attributed_error*);
GART_TEST_EACH_POLICY(GART_TEST_GRADIENTS)

}  // namespace gart_test
