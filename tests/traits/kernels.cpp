// Generalised Gaussians of every degree: hits, image and gradients against the oracle, and one tracer against another.
#include <render/agreement.hpp>
#include <support/trace_scene.hpp>

#include <cstring>

using namespace gart_test;

namespace {

struct expectation {
  oracle::scene scene;
  oracle::parameters parameters;
  oracle::picture picture;
  weighted_image weights;
};

template <int Degree>
expectation const& expected() {
  static expectation const e = [] {
    expectation out{oracle::kernel_scene(seed(), Degree), {}, {}, {}};
    auto const& s = out.scene;
    out.parameters = oracle::parameters(s.model);
    out.parameters.kernel_degree = Degree;
    out.picture = oracle::render(out.parameters, s.view, s.options, 0);
    std::mt19937_64 engine(seed());
    out.weights = weighted(s, out.parameters, out.picture, engine);
    return out;
  }();
  return e;
}

using by_group = std::vector<double>;

// The gradients' relative errors, group by group.
template <class Method, class Tracer, class E>
by_group gradient_errors(E& exec, expectation const& e) {
  auto const got =
      gradients_by<0, Method, Tracer>(exec, e.scene.model, e.scene.view, e.scene.options, 0, e.weights.color_gradient);
  by_group errors;
  for (auto const& g : gradient_groups) errors.push_back(relative_error(got.*g.got, e.weights.gradients.*g.expected));
  return errors;
}

void check_below(by_group const& errors, double tolerance) {
  for (std::size_t i = 0; i < errors.size(); ++i) {
    CAPTURE(gradient_groups[i].name);
    CHECK(errors[i] <= tolerance);
  }
}

using lists = std::vector<std::vector<gart::hit>>;

void require_same_bits(lists const& a, lists const& b) {
  REQUIRE(a.size() == b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    CAPTURE(i);
    REQUIRE(a[i].size() == b[i].size());
    if (!a[i].empty()) REQUIRE(std::memcmp(a[i].data(), b[i].data(), a[i].size() * sizeof(gart::hit)) == 0);
  }
}

// The hits by tile lists, which those of every other tracer equal.
template <class Response, class E>
lists hits_by_every_tracer(E& exec, oracle::scene const& s) {
  auto const by = [&](tracer_kind kind) { return hit_lists_of<Response>(exec, s.model, s.view, s.options, kind); };
  lists const hits = by(tracer_kind::tiles);
  require_same_bits(hits, by(tracer_kind::bvh));
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) require_same_bits(hits, by(tracer_kind::embree));
#endif
  return hits;
}

template <class Tracer, class E>
image_errors errors_of_image(E& exec, expectation const& e) {
  return image_error(render_by<0, Tracer>(exec, e.scene.model, e.scene.view, e.scene.options, 0), e.picture);
}

template <int Degree, class E>
void check_degree(E& exec) {
  int const degree = Degree;
  CAPTURE(degree);
  using response = gart::generalized_gaussian<Degree>;
  using tiles = gart::tile_tracer<E, 8, response>;
  expectation const& e = expected<Degree>();

  auto const error = errors_of_image<tiles>(exec, e);
  CHECK(error.color <= image_tolerance);
  CHECK(error.transmittance <= image_tolerance);
  CHECK(error.depth <= image_tolerance);
  CHECK(error.aside <= 2 + e.picture.pixels.size() / 100);

  lists const hits = hits_by_every_tracer<response>(exec, e.scene);
  REQUIRE(hits.size() == e.picture.pixels.size());
  for (std::size_t i = 0; i < hits.size(); ++i) {
    CAPTURE(i);
    bool differs = false;
    if (!e.picture.pixels[i].edge) REQUIRE(complaint(hits[i], e.picture.pixels[i], differs) == "");
  }

  CHECK(e.weights.aside <= 2 + e.picture.pixels.size() / 20);
  check_below(gradient_errors<gart::primitive_method, tiles>(exec, e), 1e-4);
  if constexpr (Degree == 1)
    check_below(gradient_errors<gart::pixel_method, gart::bvh_tracer<E, response>>(exec, e), 1e-4);
}

}  // namespace

TEST_CASE_TEMPLATE("every kernel degree agrees with the oracle, by every tracer", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  check_degree<1>(exec);
  check_degree<3>(exec);
  check_degree<4>(exec);
  check_degree<5>(exec);
  check_degree<8>(exec);
}
