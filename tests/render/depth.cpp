// Gradients of a random linear function of an image's colour, depth and transmittance, group by group, against the
// oracle, and what a pass says that was not asked for them.
#include <render/expected.hpp>
#include <support/trace_scene.hpp>

#include <gart/core/error.hpp>

#include <random>
#include <string>

using namespace gart_test;

namespace {

// Zero where rounding may take another branch, as gradients.cpp has it.
struct weighted_depth {
  std::vector<float> color, depth, transmittance;
  oracle::parameters gradients;
};

weighted_depth weigh(oracle::scene const& s, oracle::parameters const& p, oracle::picture const& picture,
                     std::mt19937_64& engine) {
  weighted_depth w;
  w.color = weighted(s, p, picture, engine).color_gradient;
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  for (std::size_t k = 0; k < picture.pixels.size(); ++k) {
    bool const aside = w.color[3 * k] == 0;
    // As far as things lie, so that depth and colour weigh alike.
    float const far = picture.pixels[k].list.empty() ? 1.0f : static_cast<float>(picture.pixels[k].list.back().t);
    w.depth.push_back(aside ? 0.0f : uniform(engine) / far), w.transmittance.push_back(aside ? 0.0f : uniform(engine));
  }
  w.gradients = oracle::gradients(p, s.view, s.options, s.active_degree, {w.color.begin(), w.color.end()},
                                  {w.transmittance.begin(), w.transmittance.end()}, {w.depth.begin(), w.depth.end()});
  return w;
}

std::vector<weighted_depth> const& weights() {
  static std::vector<weighted_depth> const all = [] {
    std::vector<weighted_depth> out;
    std::mt19937_64 engine(seed() + 2);
    for (auto const& e : expectations()) out.push_back(weigh(e.scene, e.parameters, e.picture, engine));
    return out;
  }();
  return all;
}

template <class Tracer, class E, class Method>
void check_scene(E& exec, expectation const& e, weighted_depth const& w, Method) {
  CAPTURE(std::string(Method::name));
  auto const& s = e.scene;
  detail::with_degree(s.model.sh_degree, [&](auto degree) {
    // At other degrees one method stands for all: geometry does not know them.
    if constexpr (degree == 3 || std::same_as<Method, gart::primitive_method>) {
      auto const got = depth_gradients_by<degree, Method, Tracer>(exec, s.model, s.view, s.options, s.active_degree,
                                                                  w.color, w.depth, w.transmittance);
      for (auto const& g : gradient_groups) {
        CAPTURE(g.name);
        CHECK(relative_error(got.*g.got, w.gradients.*g.expected) <= 1e-4);
      }
    }
  });
}

}  // namespace

TEST_CASE_TEMPLATE("gradients of depth agree with the oracle", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (std::size_t i = 0; i < expectations().size(); ++i) {
    auto const& e = expectations()[i];
    CAPTURE(e.scene.name);
    gradient_methods::for_each(
        [&]<class Method>(Method s) { check_scene<gart::tile_tracer<E>>(exec, e, weights()[i], s); });
    if (e.scene.model.sh_degree == 3) {
      check_scene<gart::bvh_tracer<E>>(exec, e, weights()[i], gart::primitive_method{});
      check_scene<gart::bvh_tracer<E>>(exec, e, weights()[i], gart::pixel_method{});
    }
  }
}

// One opaque Gaussian on the ray: its depth is w t, and moving it away moves that by w.
TEST_CASE_TEMPLATE("a Gaussian alone has a depth gradient in closed form", E, GART_TEST_POLICIES) {
  gart::camera view;
  view.width = view.height = 1, view.fx = view.fy = 1, view.cx = view.cy = 0.5f;
  gart::gaussian_model m;
  m.sh_degree = 3;
  m.mean = {0, 0, 4}, m.log_scale = {-2, -2, -1}, m.quaternion = {1, 0, 0, 0}, m.opacity = {0.5f};
  m.sh.assign(48, 0.1f);
  float const sigma = 1 / (1 + std::exp(-0.5f));
  E exec;
  auto const got =
      depth_gradients_by<3, gart::primitive_method, gart::tile_tracer<E>>(exec, m, view, {}, 3, {0, 0, 0}, {2}, {0.5f});
  CHECK(got.mean[2] == doctest::Approx(2 * sigma).epsilon(1e-5));
  CHECK(got.mean[0] == doctest::Approx(0).epsilon(1e-6));
  CHECK(got.opacity[0] == doctest::Approx((2 * 4 - 0.5f) * sigma * (1 - sigma)).epsilon(1e-5));
  CHECK(got.log_scale[2] == doctest::Approx(0).epsilon(1e-6));
  for (float const c : got.sh) CHECK(c == 0);
}

TEST_CASE_TEMPLATE("depth gradients without preparation are refused", E, GART_TEST_POLICIES) {
  using frame_type = frame_by<3, gart::tile_tracer<E>, E>;
  auto const& s = expectations().front().scene;
  E exec;
  gart::gaussians<E> const scene(exec, s.model);
  gart::gaussians<E> gradients(exec, scene.size(), s.model.sh_degree);
  std::size_t const pixels = static_cast<std::size_t>(s.view.width) * s.view.height;
  gart::buffer<float, E> color(exec, 3 * pixels), depth(exec, pixels);
  frame_type frame(exec);
  REQUIRE(s.model.sh_degree == 3);
  frame.prepare(scene.view(), s.view, s.options, s.active_degree);

  gart::backward_pass<frame_type, gart::primitive_method> plain(exec);
  REQUIRE(plain.prepare(frame));
  plain.render(frame, {.color = color.data(), .depth = depth.data()});
  CHECK_THROWS_WITH_AS(gart::differentiate(frame, plain, {color, depth}, gradients),
                       "differentiate: the method has no gradient of depth: take with_depth<method>",
                       gart::invalid_argument);
  std::size_t const bytes = plain.hit_buffer_bytes();

  gart::backward_pass<frame_type, gart::with_depth<gart::primitive_method>> deep(exec);
  REQUIRE(deep.prepare(frame));
  CHECK(deep.hit_buffer_bytes() == bytes / 16 * 20);
  deep.render(frame, {.color = color.data()});
  CHECK_THROWS_AS(gart::differentiate(frame, deep, {color, depth}, gradients), gart::invalid_argument);
  deep.render(frame, {.color = color.data(), .depth = depth.data()});
  CHECK_THROWS_AS(gart::differentiate(frame, deep, {color, color}, gradients), gart::invalid_argument);
  gart::differentiate(frame, deep, {color, depth}, gradients);
  gart::differentiate(frame, deep, color, gradients);
}
