// Images and hit lists of scene_by_kind.hpp.
#include <gart/exec/parallel.hpp>  // the serial policy, which others are held to

#include <support/policies.hpp>
#include <support/trace_scene.hpp>

namespace gart_test {

template <class E>
traced<E> render_scene(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                       gart::render_options const& options, int active_degree, tracer_kind kind) {
  return detail::with_tracer<E>(kind, [&]<class Tracer>(std::type_identity<Tracer>) {
    return detail::with_degree(model.sh_degree, [&](auto degree) {
      return render_by<degree, Tracer>(exec, model, view, options, active_degree);
    });
  });
}

template <class E>
std::vector<std::vector<gart::hit>> hit_lists(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                                              gart::render_options const& options, tracer_kind kind) {
  return hit_lists_of<gart::generalized_gaussian<>>(exec, model, view, options, kind);
}

#define GART_TEST_HIT_LISTS(E)                                                                                 \
  template std::vector<std::vector<gart::hit>> hit_lists(E&, gart::gaussian_model const&, gart::camera const&, \
                                                         gart::render_options const&, tracer_kind);
#define GART_TEST_IMAGES(E)                                                                                          \
  template traced<E> render_scene(E&, gart::gaussian_model const&, gart::camera const&, gart::render_options const&, \
                                  int, tracer_kind);                                                                 \
  GART_TEST_HIT_LISTS(E)
GART_TEST_EACH_POLICY(GART_TEST_IMAGES)
#if defined(GART_TEST_CUDA)
GART_TEST_HIT_LISTS(gart::serial_exec)
#endif

}  // namespace gart_test
