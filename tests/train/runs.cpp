// The trainers of runs.hpp, and the views of capture.hpp.
#include <support/trace_scene.hpp>
#include <train/runs.hpp>

namespace gart_test {

template <class E>
traced<E> pictured(E& exec, gart::gaussian_model const& model, gart::camera const& view) {
  return render_by<1, gart::tile_tracer<E>>(exec, model, view, {}, 1);
}
#define GART_TEST_PICTURED(E) template traced<E> pictured(E&, gart::gaussian_model const&, gart::camera const&);
GART_TEST_EACH_POLICY(GART_TEST_PICTURED)

}  // namespace gart_test

#define GART_TEST_TRAINERS(E)                   \
  GART_TEST_TRAINER(E, gart::primitive_method); \
  GART_TEST_TRAINER(E, gart::hybrid_method);    \
  GART_TEST_TRAINER(E, gart::pixel_method);     \
  GART_TEST_TRAINER(E, gart::deterministic_method);
GART_TEST_EACH_POLICY(GART_TEST_TRAINERS)
