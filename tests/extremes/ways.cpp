// The ways of ways.hpp.
#include <extremes/way.hpp>

#include <optional>
#include <stdexcept>
#include <type_traits>

namespace gart_test {

namespace {

// Calls f(kind, method, type_identity of the tracer) for each.
template <class E, class F>
void for_each_way(F&& f) {
  gradient_methods::for_each([&]<class Method>(Method s) {
    if constexpr (E::device || !Method::lane_by_lane)
      f(tracer_kind::tiles, s, std::type_identity<gart::tile_tracer<E>>{});
    if constexpr (!differs_in_gather<Method>) {
      f(tracer_kind::bvh, s, std::type_identity<gart::bvh_tracer<E>>{});
#if defined(GART_WITH_EMBREE)
      if constexpr (!E::device) f(tracer_kind::embree, s, std::type_identity<gart::embree_tracer<E>>{});
#endif
    }
  });
}

}  // namespace

template <class E>
outcome run_one(E& exec, tracer_kind kind, std::string const& method, gart::gaussian_model const& model,
                gart::camera const& view, gart::render_options const& options,
                std::vector<float> const& color_gradient) {
  std::optional<outcome> out;
  for_each_way<E>([&]<class Method, class Tracer>(tracer_kind k, Method, std::type_identity<Tracer>) {
    if (k == kind && method == Method::name) out = run_by<Method, Tracer>(exec, model, view, options, color_gradient);
  });
  if (!out) throw std::runtime_error("not compiled here: " + method);
  return *out;
}

template <class E>
std::vector<outcome> run_all(E& exec, gart::gaussian_model const& model, gart::camera const& view,
                             gart::render_options const& options, std::vector<float> const& color_gradient) {
  auto const first = [](tracer_kind kind, std::string const& method) {
    return kind == tracer_kind::tiles && method == gart::primitive_method::name;
  };
  std::vector<outcome> all{
      run_one(exec, tracer_kind::tiles, gart::primitive_method::name, model, view, options, color_gradient)};
  for_each_way<E>([&]<class Method, class Tracer>(tracer_kind kind, Method, std::type_identity<Tracer>) {
    if (!first(kind, Method::name)) all.push_back(run_by<Method, Tracer>(exec, model, view, options, color_gradient));
  });
  return all;
}

#define GART_TEST_WAYS(E)                                                                                         \
  template outcome run_one(E&, tracer_kind, std::string const&, gart::gaussian_model const&, gart::camera const&, \
                           gart::render_options const&, std::vector<float> const&);                               \
  template std::vector<outcome> run_all(E&, gart::gaussian_model const&, gart::camera const&,                     \
                                        gart::render_options const&, std::vector<float> const&);
GART_TEST_EACH_POLICY(GART_TEST_WAYS)

}  // namespace gart_test
