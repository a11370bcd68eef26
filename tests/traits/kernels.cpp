// Generalised Gaussians of every degree: hits, image and gradients against the oracle, and one tracer against another.
#include <render/agreement.hpp>

#include <cstring>
#include <type_traits>

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

template <class Strategy, class Tracer, class E>
void check_gradients(E& exec, expectation const& e) {
  CAPTURE(Tracer::name);
  CAPTURE(Strategy::name);
  CHECK(e.weights.aside <= 2 + e.picture.pixels.size() / 20);
  auto const got = gradients_by<0, Strategy, Tracer>(exec, e.scene.model, e.scene.view, e.scene.options, 0,
                                                     e.weights.color_gradient);
  for (auto const& g : gradient_groups) {
    CAPTURE(g.name);
    CHECK(relative_error(got.*g.got, e.weights.gradients.*g.expected) <= 1e-4);
  }
}

template <int Degree, class E>
void check_degree(E& exec) {
  int const degree = Degree;
  CAPTURE(degree);
  using response = gart::generalized_gaussian<Degree>;
  using tiles = gart::tile_tracer<E, 8, response>;
  expectation const& e = expected<Degree>();
  auto const& s = e.scene;

  tiles tracer(exec);
  auto const error = image_error(render_by<0>(exec, tracer, s.model, s.view, s.options, 0), e.picture);
  CHECK(error.color <= image_tolerance);
  CHECK(error.transmittance <= image_tolerance);
  CHECK(error.depth <= image_tolerance);
  CHECK(error.aside <= 2 + e.picture.pixels.size() / 100);

  auto const lists = hit_lists<response>(exec, s.model, s.view, s.options, tracer_kind::tiles);
  auto const by_bvh = hit_lists<response>(exec, s.model, s.view, s.options, tracer_kind::bvh);
  REQUIRE(lists.size() == e.picture.pixels.size());
  for (std::size_t i = 0; i < lists.size(); ++i) {
    CAPTURE(i);
    bool differs = false;
    if (!e.picture.pixels[i].edge) REQUIRE(complaint(lists[i], e.picture.pixels[i], differs) == "");
    REQUIRE(lists[i].size() == by_bvh[i].size());
    if (!lists[i].empty())
      REQUIRE(std::memcmp(lists[i].data(), by_bvh[i].data(), lists[i].size() * sizeof(gart::hit)) == 0);
  }
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) {
    auto const by_embree = hit_lists<response>(exec, s.model, s.view, s.options, tracer_kind::embree);
    for (std::size_t i = 0; i < lists.size(); ++i) {
      REQUIRE(lists[i].size() == by_embree[i].size());
      if (!lists[i].empty())
        REQUIRE(std::memcmp(lists[i].data(), by_embree[i].data(), lists[i].size() * sizeof(gart::hit)) == 0);
    }
  }
#endif

  check_gradients<gart::primitive_strategy, tiles>(exec, e);
  if constexpr (Degree == 1) check_gradients<gart::pixel_strategy, gart::bvh_tracer<E, response>>(exec, e);
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
