// Gradients of focal lengths and principal points against central differences of the reference in double, through
// every lens and shutter that has them.
#include <gart/reference/reference.hpp>
#include <lens/traced_rays.hpp>
#include <oracle/scenes.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <string>

using namespace gart_test;

namespace {

constexpr int degree = 3;

float gart::camera::*const numbers[] = {&gart::camera::fx, &gart::camera::fy, &gart::camera::cx, &gart::camera::cy};

struct seen_through {
  char const* name;
  gart::camera view;
};

std::vector<seen_through> cameras(gart::camera pinhole) {
  using enum gart::camera_kind;
  pinhole = gart::resized(pinhole, 11, 9);
  pinhole.lens = {};
  // Steps of these are exact in float.
  for (auto const number : numbers) pinhole.*number = std::round(pinhole.*number * 256) / 256;
  std::vector<seen_through> out;
  auto const add = [&](char const* name, gart::camera_kind kind, gart::distortion const& lens) -> gart::camera& {
    gart::camera c = pinhole;
    c.kind = kind, c.lens = lens;
    out.push_back({name, c});
    return out.back().view;
  };
  add("PINHOLE", perspective, {});
  add("OPENCV", perspective, {.k1 = -0.1f, .k2 = 0.02f, .p1 = 0.003f, .p2 = -0.002f});
  add("FULL_OPENCV", perspective, {.k1 = -0.1f, .k2 = 0.02f, .p1 = 0.003f, .k3 = 0.01f, .d1 = 0.05f, .d2 = 0.01f});
  add("OPENCV_FISHEYE", fisheye, {.k1 = 0.05f, .k2 = -0.01f, .k3 = 0.002f, .k4 = -0.001f});
  add("THIN_PRISM_FISHEYE", fisheye, {.k1 = 0.05f, .p1 = 0.002f, .p2 = -0.003f, .s1 = 0.004f, .s3 = -0.002f});
  add("RAD_TAN_THIN_PRISM_FISHEYE", fisheye624,
      {.k1 = 0.05f, .p1 = 0.002f, .p2 = -0.003f, .s1 = 0.004f, .s2 = 0.001f, .s3 = -0.002f, .s4 = 0.001f});
  add("FOV", fov, {.omega = 0.7f});
  add("EUCM", eucm, {.alpha = 0.6f, .beta = 1.1f});
  add("division", division, {.k1 = -0.1f});
  gart::camera& rolling = add("OPENCV_FISHEYE, rolling", fisheye, {.k1 = 0.05f, .k2 = -0.01f});
  rolling.shutter = gart::shutter_kind::right_to_left;
  rolling.turn = {0.1f, -0.15f, 0.2f}, rolling.travel = {0.3f, 0.2f, -0.1f};
  gart::camera& parallel = add("orthographic", orthographic, {});
  parallel.fx *= 0.5f, parallel.fy *= 0.5f;
  return out;
}

// Of a camera, the gradient of a loss by its image, zero where a difference may cross a step, and the loss's
// derivatives.
struct expectation {
  std::string name;
  gart::camera view;
  image_weights weights;
  std::array<double, 4> by{};
};

expectation expect(oracle::scene const& s, seen_through const& through, std::mt19937_64& random) {
  gart::camera const& view = through.view;
  auto const pixels = gart::all_pixels(view);
  auto const render = [&](gart::camera const& c) {
    return gart::trace_reference(s.model, c, s.options, s.active_degree, pixels);
  };
  expectation out{through.name, view, {}, {}};
  std::vector<bool> usable(pixels.size(), true);
  std::vector<std::array<double, 4>> slopes(3 * pixels.size());
  auto const base = render(view);
  for (std::size_t k = 0; k < 4; ++k) {
    float const h = view.*numbers[k] > 4 ? 0x1p-9f : 0x1p-11f;
    auto const moved = [&](float by) {
      gart::camera c = view;
      c.*numbers[k] += by;
      REQUIRE(c.*numbers[k] - view.*numbers[k] == by);
      return render(c);
    };
    auto const a = moved(h), b = moved(-h), c = moved(2 * h), d = moved(-2 * h);
    for (std::size_t i = 0; i < 3 * pixels.size(); ++i) {
      // What is smooth has the same slope at twice the step, but for h^2, and the same hits.
      double const near = (a.color[i] - b.color[i]) / (2 * double{h}),
                   far = (c.color[i] - d.color[i]) / (4 * double{h});
      bool const smooth = std::abs(near - far) <= 1e-5 * std::abs(near) + 1e-7 && a.hits[i / 3] == base.hits[i / 3] &&
                          b.hits[i / 3] == base.hits[i / 3] && c.hits[i / 3] == base.hits[i / 3] &&
                          d.hits[i / 3] == base.hits[i / 3];
      usable[i / 3] = usable[i / 3] && smooth;
      slopes[i][k] = (4 * near - far) / 3;
    }
  }
  CHECK(std::count(usable.begin(), usable.end(), true) > static_cast<long>(pixels.size() / 2));
  // Half the squared distance from the image of another lens has the difference for its gradient.
  std::normal_distribution<float> normal(0, 0.03f);
  gart::camera away = view;
  for (auto const number : numbers) away.*number += normal(random) * view.fx;
  auto const there = render(away);
  for (std::size_t i = 0; i < slopes.size(); ++i) {
    out.weights.color.push_back(usable[i / 3] ? static_cast<float>(base.color[i] - there.color[i]) : 0.0f);
    for (std::size_t k = 0; k < 4; ++k) out.by[k] += double{out.weights.color.back()} * slopes[i][k];
  }
  return out;
}

std::vector<expectation> const& expectations(oracle::scene const& s) {
  static std::vector<expectation> const all = [&] {
    std::vector<expectation> out;
    std::mt19937_64 random(seed());
    for (seen_through const& c : cameras(s.view)) out.push_back(expect(s, c, random));
    return out;
  }();
  return all;
}

oracle::scene scene() {
  oracle::scene s = oracle::smooth_scene(seed(), degree, 2.0f);
  s.options.near = 1e-3f;  // a step, and left out as steps are
  return s;
}

template <class E, class Tracer>
double worst_of(oracle::scene const& s) {
  E exec;
  double worst = 0;
  for (expectation const& e : expectations(s)) {
    CAPTURE(e.name);
    auto const got =
        ray_gradients_by<degree, Tracer>(exec, s.model, e.view, s.options, s.active_degree, e.weights, true).lens;
    double const by[] = {got.fx, got.fy, got.cx, got.cy};
    double error = 0, norm = 0;
    for (std::size_t k = 0; k < 4; ++k) error += (by[k] - e.by[k]) * (by[k] - e.by[k]), norm += e.by[k] * e.by[k];
    REQUIRE(norm > 0);
    CHECK(std::sqrt(error / norm) <= 1e-5);
    worst = std::max(worst, std::isfinite(error) ? std::sqrt(error / norm) : HUGE_VAL);
  }
  return worst;
}

}  // namespace

TEST_CASE_TEMPLATE("lens gradients match the reference through every camera", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  oracle::scene const s = scene();
  double worst = worst_of<E, gart::tile_tracer<E>>(s);
  worst = std::max(worst, worst_of<E, gart::bvh_tracer<E>>(s));
#if defined(GART_WITH_EMBREE)
  if constexpr (!E::device) worst = std::max(worst, worst_of<E, gart::embree_tracer<E>>(s));
#endif
  MESSAGE("worst relative error " << worst);
}

TEST_CASE_TEMPLATE("no focal length, or pixel filters: refused by name", E, GART_TEST_POLICIES) {
  E exec;
  oracle::scene s = scene();
  gart::camera sphere = s.view;
  sphere.kind = gart::camera_kind::equirectangular, sphere.lens = {};
  image_weights const weights{std::vector<float>(static_cast<std::size_t>(3 * sphere.width * sphere.height)), {}, {}};
  auto const refused = [&](gart::camera const& view, gart::render_options const& options, char const* what) {
    CHECK_THROWS_WITH_AS(
        (ray_gradients_by<degree, gart::tile_tracer<E>>(exec, s.model, view, options, degree, weights, true)),
        doctest::Contains(what), gart::invalid_argument);
  };
  refused(sphere, s.options, "no focal length");
  sphere.shutter = gart::shutter_kind::top_to_bottom, sphere.turn = {0.1f, 0, 0};
  refused(sphere, s.options, "no focal length");
  s.options.antialias = 0.5f;
  refused(s.view, s.options, "antialias");
}
