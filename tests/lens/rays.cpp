// Gradients of rays, a pixel for itself, against central differences of the oracle's images, which turns and shifts its
// camera in double: a turn w moves a direction by w x d, a shift the origin.
#include <lens/traced_rays.hpp>
#include <oracle/moved_pictures.hpp>

#include <algorithm>
#include <cmath>
#include <random>

using namespace gart_test;

namespace {

// A scene, the gradient of a loss by its image, zero where a difference crosses a step, and the loss's derivatives a
// pixel: by a shift of its ray, then by a turn.
struct expectation {
  oracle::scene scene;
  image_weights weights;
  std::vector<double> by_shift, by_turn;  // [H][W][3]
};

expectation expect(oracle::scene s, std::mt19937_64& random, bool with_depth) {
  s.options.near = 1e-3f;  // what it cuts off is a step, and left out as steps are
  oracle::moved_pictures const pictures = oracle::move_camera(s);
  std::vector<bool> const& usable = pictures.smooth;
  std::size_t const pixels = usable.size();
  REQUIRE(std::count(usable.begin(), usable.end(), true) > static_cast<long>(pixels / 2));
  expectation out{s, {}, std::vector<double>(3 * pixels), std::vector<double>(3 * pixels)};
  std::normal_distribution<float> normal;
  for (std::size_t p = 0; p < pixels; ++p) {
    for (int c = 0; c < 3; ++c) out.weights.color.push_back(usable[p] ? normal(random) : 0.0f);
    if (with_depth) out.weights.depth.push_back(usable[p] ? normal(random) : 0.0f);
    if (with_depth) out.weights.transmittance.push_back(usable[p] ? normal(random) : 0.0f);
  }
  auto const loss = [&](oracle::pixel const& at, std::size_t p) {
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) sum += double{out.weights.color[3 * p + c]} * at.color[c];
    if (with_depth)
      sum += double{out.weights.depth[p]} * at.depth + double{out.weights.transmittance[p]} * at.transmittance;
    return sum;
  };
  for (std::size_t p = 0; p < pixels; ++p)
    for (std::size_t k = 0; k < 6; ++k) {
      auto const of_pixel = [&](oracle::pixel const& at) { return loss(at, p); };
      (k < 3 ? out.by_shift : out.by_turn)[3 * p + k % 3] = pictures.slope(k, p, of_pixel);
    }
  return out;
}

double relative(std::vector<double> const& got, std::vector<double> const& expected) {
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < got.size(); ++i)
    error += (got[i] - expected[i]) * (got[i] - expected[i]), norm += expected[i] * expected[i];
  REQUIRE(norm > 0);
  return std::isfinite(error) ? std::sqrt(error / norm) : HUGE_VAL;
}

template <class E, int Degree, class Tracer>
double worst_of(expectation const& e) {
  E exec;
  auto const& s = e.scene;
  REQUIRE(s.model.sh_degree == Degree);
  auto const got =
      ray_gradients_by<Degree, Tracer>(exec, s.model, s.view, s.options, s.active_degree, e.weights, false);
  std::vector<double> shift(got.origin.begin(), got.origin.end()), turn(shift.size());
  double along = 0, longest = 0;
  for (std::size_t p = 0; p < turn.size() / 3; ++p) {
    oracle::direction const r =
        oracle::ray_through(s.view, static_cast<int>(p) % s.view.width, static_cast<int>(p) / s.view.width);
    double const d[3] = {r.x, r.y, r.z};
    float const* const b = &got.direction[3 * p];
    double radial = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      turn[3 * p + k] = d[(k + 1) % 3] * double{b[(k + 2) % 3]} - d[(k + 2) % 3] * double{b[(k + 1) % 3]};
      radial += d[k] * double{b[k]};
    }
    along = std::max(along, std::abs(radial));
    longest = std::max(longest, std::hypot(double{b[0]}, double{b[1]}, double{b[2]}));
  }
  CHECK(along < 1e-5 * longest);
  return std::max(relative(shift, e.by_shift), relative(turn, e.by_turn));
}

}  // namespace

TEST_CASE_TEMPLATE("ray gradients match differences of the oracle's images", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 random(seed);
  auto const smooth = [&](int degree) {
    return oracle::smooth_scene(seed + static_cast<std::uint64_t>(degree), degree, 2.0f);
  };
  double worst = 0;
  auto const check = [&](double error) {
    worst = std::max(worst, error);
    CHECK(error <= 1e-5);
  };
  for (bool const with_depth : {false, true}) {
    CAPTURE(with_depth);
    check(worst_of<E, 0, gart::tile_tracer<E>>(expect(smooth(0), random, with_depth)));
    expectation const whole = expect(smooth(3), random, with_depth);
    check(worst_of<E, 3, gart::tile_tracer<E>>(whole));
    check(worst_of<E, 3, gart::bvh_tracer<E>>(whole));
#if defined(GART_WITH_EMBREE)
    if constexpr (!E::device) check(worst_of<E, 3, gart::embree_tracer<E>>(whole));
#endif
    oracle::scene low = smooth(3);
    low.active_degree = 1, low.view.lens = {};
    check(worst_of<E, 3, gart::tile_tracer<E>>(expect(low, random, with_depth)));
  }
  MESSAGE("worst relative error " << worst);
}

TEST_CASE_TEMPLATE("gradients of rays are refused where images do not fit", E, GART_TEST_POLICIES) {
  E exec;
  oracle::scene s = oracle::smooth_scene(1, 0, 2.0f);
  s.options.near = 1e-3f;
  gart::gaussians<E> const scene(exec, s.model);
  frame_by<0, gart::tile_tracer<E>, E> frame(exec);
  frame.prepare(scene.view(), s.view, s.options);
  std::size_t const pixels = static_cast<std::size_t>(s.view.width) * s.view.height;
  gart::buffer<float, E> const image(exec, 3 * pixels), depth(exec, pixels), shorter(exec, 3);
  gart::buffer<float, E> out(exec, 3 * pixels);
  auto const refused = [&](auto const& color, gart::image_gradients const& by, gart::ray_targets const& to,
                           char const* what) {
    CHECK_THROWS_WITH_AS(gart::differentiate_rays(frame, color, by, to), doctest::Contains(what),
                         gart::invalid_argument);
  };
  refused(shorter, {image}, {out.data()}, "three values for each pixel");
  refused(image, {shorter}, {out.data()}, "three values for each pixel");
  refused(image, {image, shorter}, {out.data()}, "a value for each pixel");
  refused(image, {image, depth}, {out.data()}, "needs the image's depth");
  refused(image, {image}, {}, "ray_targets.direction");
}
