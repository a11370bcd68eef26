// Gradients of poses against central differences of the oracle's images, which is turned and shifted in double.
#include <gart/pose/differentiate_pose.hpp>
#include <oracle/moved_pictures.hpp>
#include <oracle/scenes.hpp>
#include <support/policies.hpp>
#include <support/scene_by_kind.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <vector>

using namespace gart_test;

namespace {

// A scene, the gradient of a loss by its image, zero where a difference crosses a step, and the loss's derivatives.
struct expectation {
  oracle::scene scene;
  std::vector<float> weights;
  double translation[3], rotation[3];
};

expectation expect(oracle::scene s, std::mt19937_64& random) {
  s.options.near = 1e-3f;  // what it cuts off is a step, and left out as steps are
  expectation out{s, {}, {}, {}};
  oracle::moved_pictures const pictures = oracle::move_camera(s);
  std::vector<bool> const& usable = pictures.smooth;
  std::size_t const pixels = usable.size();
  REQUIRE(std::count(usable.begin(), usable.end(), true) > static_cast<long>(pixels / 2));
  // Half the squared distance from the image of another pose has the difference for its gradient.
  std::normal_distribution<double> normal(0, 0.05);
  oracle::motion away;
  for (int k = 0; k < 3; ++k) away.shift[k] = normal(random), away.turn[k] = normal(random);
  auto const there = oracle::render(oracle::parameters(s.model), s.view, s.options, s.active_degree, away);
  for (std::size_t p = 0; p < pixels; ++p)
    for (int c = 0; c < 3; ++c) {
      double const difference = pictures.base.pixels[p].color[c] - there.pixels[p].color[c];
      out.weights.push_back(usable[p] ? static_cast<float>(difference) : 0.0f);
    }
  for (int k = 0; k < 6; ++k) {
    double sum = 0;
    for (std::size_t p = 0; p < pixels; ++p)
      for (int c = 0; c < 3; ++c) {
        auto const of_pixel = [&](oracle::pixel const& at) { return at.color[c]; };
        sum += double{out.weights[3 * p + c]} * pictures.slope(static_cast<std::size_t>(k), p, of_pixel);
      }
    (k < 3 ? out.translation[k] : out.rotation[k - 3]) = sum;
  }
  return out;
}

double relative(gart::vec3d const& got, double const (&expected)[3]) {
  double error = 0, norm = 0;
  for (int k = 0; k < 3; ++k)
    error += (got[k] - expected[k]) * (got[k] - expected[k]), norm += expected[k] * expected[k];
  REQUIRE(norm > 0);
  return std::isfinite(error) ? std::sqrt(error / norm) : HUGE_VAL;
}

// What the sum over Gaussians asks of a frame.
template <class E, int Degree>
struct stored {
  using execution_type = E;
  static constexpr int sh_degree = Degree;
  E* policy;
  gart::gaussians_view<float const> gaussians;
  gart::camera seen_by;
  E& exec() const { return *policy; }
  gart::gaussians_view<float const> scene() const { return gaussians; }
  gart::camera const& view() const { return seen_by; }
};

// By the gradients of each tracer and method.
template <class E, class F>
void by_all(expectation const& e, F const& check) {
  E exec;
  auto const& s = e.scene;
  gart::gaussians<E> const scene(exec, s.model);
  for (tracer_kind const kind : {tracer_kind::bvh, tracer_kind::tiles})
    for (std::string const& method : methods_for(kind, s.model.sh_degree)) {
      CAPTURE(gart::to_string(kind));
      CAPTURE(method);
      gart::gaussians<E> const gradients(
          exec, scene_gradients(exec, s.model, s.view, s.options, s.active_degree, kind, method, e.weights));
      detail::with_degree(s.model.sh_degree, [&](auto degree) {
        check(gart::differentiate_pose(stored<E, degree>{&exec, scene.view(), s.view}, gradients.view()));
      });
    }
}

std::vector<expectation> const& expectations() {
  static std::vector<expectation> const all = [] {
    std::vector<expectation> out;
    std::mt19937_64 random(seed());
    for (int degree = 0; degree <= 3; ++degree) {
      oracle::scene s = oracle::smooth_scene(seed() + static_cast<std::uint64_t>(degree), degree, 2.0f);
      out.push_back(expect(s, random));
      s.options.antialias = 0.7f;
      s.name = "smooth, through the filter of the pixels";
      out.push_back(expect(s, random));
    }
    oracle::scene low = oracle::smooth_scene(seed(), 3, 8.0f);
    low.name = "smooth, the first two bands", low.active_degree = 1;
    out.push_back(expect(low, random));
    low.view.lens = {}, low.name = "smooth, a pinhole";
    out.push_back(expect(low, random));
    return out;
  }();
  return all;
}

}  // namespace

TEST_CASE_TEMPLATE("pose gradients match differences of the oracle's images", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  double worst = 0;
  for (expectation const& e : expectations()) {
    CAPTURE(e.scene.name);
    CAPTURE(e.scene.model.sh_degree);
    by_all<E>(e, [&](gart::pose_gradient const& got) {
      double const t = relative(got.translation, e.translation), r = relative(got.rotation, e.rotation);
      worst = std::max({worst, t, r});
      CHECK(t <= 1e-5);
      CHECK(r <= 1e-5);
    });
  }
  MESSAGE("worst relative error " << worst);
}

TEST_CASE_TEMPLATE("sums over Gaussians match double, broken ones left out", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  E exec;
  for (std::size_t const count : {std::size_t{0}, std::size_t{1}, std::size_t{64}, std::size_t{20011}}) {
    CAPTURE(count);
    gart::gaussian_model model, gradients;
    for (auto* m : {&model, &gradients}) {
      m->resize(count, 2);
      for (auto* values : {&m->mean, &m->log_scale, &m->quaternion, &m->opacity, &m->sh})
        for (float& x : *values) x = normal(random);
    }
    gart::camera view;
    view.position = {1e6, -2e6, 3};
    for (std::size_t k = 0; k < model.mean.size(); ++k)
      model.mean[k] += static_cast<float>(view.position[static_cast<int>(k % 3)]);
    double expected[6] = {};
    for (std::size_t i = 0; i < count; ++i) {
      if (i % 7 == 3) gradients.quaternion[4 * i] = std::numeric_limits<float>::quiet_NaN();
      if (i % 7 == 5) {
        for (std::size_t k = 0; k < 3; ++k) gradients.mean[3 * i + k] = gradients.sh[27 * i + k] = 0;  // not seen
      }
      if (i % 7 == 3 || i % 7 == 5) continue;
      double arm[3], by[3];
      for (std::size_t k = 0; k < 3; ++k) {
        arm[k] = double{model.mean[3 * i + k]} - view.position[static_cast<int>(k)],
        by[k] = double{gradients.mean[3 * i + k]};
        expected[k] -= by[k];
      }
      for (std::size_t k = 0; k < 3; ++k)
        expected[3 + k] -= arm[(k + 1) % 3] * by[(k + 2) % 3] - arm[(k + 2) % 3] * by[(k + 1) % 3];
      float const *q = &model.quaternion[4 * i], *g = &gradients.quaternion[4 * i];
      for (std::size_t k = 0; k < 3; ++k) {
        std::size_t const a = 1 + (k + 1) % 3, b = 1 + (k + 2) % 3;
        expected[3 + k] -= 0.5 * (double{q[0]} * double{g[1 + k]} - double{g[0]} * double{q[1 + k]} -
                                  (double{g[a]} * double{q[b]} - double{g[b]} * double{q[a]}));
      }
      // The turn of the colours, by differences of the band's functions is what the oracle's test has; here its sum.
      gart::vec3 const turn = gart::sh_turn<2>(&model.sh[27 * i], &gradients.sh[27 * i]);
      for (int k = 0; k < 3; ++k) expected[3 + k] += double{turn[k]};
    }
    gart::gaussians<E> const scene(exec, model), by(exec, gradients);
    stored<E, 2> const frame{&exec, scene.view(), view};
    auto const got = gart::differentiate_pose(frame, by.view());
    for (int k = 0; k < 3; ++k) {
      CHECK(std::abs(got.translation[k] - expected[k]) <= 1e-5 * (1 + std::sqrt(static_cast<double>(count))));
      CHECK(std::abs(got.rotation[k] - expected[3 + k]) <= 1e-4 * (1 + std::sqrt(static_cast<double>(count))));
    }
    gart::gaussians<E> const fewer(exec, count + 1, 2);
    CHECK_THROWS_AS(gart::differentiate_pose(frame, fewer.view()), gart::invalid_argument);
  }
}
