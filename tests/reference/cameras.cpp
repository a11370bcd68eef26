// Every camera model through the library, as programs have it, against the reference in double: images, and gradients
// within the bounds of a pinhole's; and all tracers alike, bit for bit.
#include <camera/lenses.hpp>
#include <gart/reference/reference.hpp>
#include <gart/runtime/renderer.hpp>
#include <support/policies.hpp>
#include <support/relative_error.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace {

struct named_view {
  std::string name;
  gart::camera view;
};

// All lenses, standing still and while they move, and parallel rays.
std::vector<named_view> views(std::mt19937_64& random) {
  std::normal_distribution<float> normal;
  std::vector<named_view> all;
  gart::shutter_kind const shutters[] = {gart::shutter_kind::top_to_bottom, gart::shutter_kind::left_to_right,
                                         gart::shutter_kind::bottom_to_top, gart::shutter_kind::right_to_left};
  gart::camera pinhole;
  pinhole.width = 44, pinhole.height = 37, pinhole.fx = 30, pinhole.fy = 31, pinhole.cx = 21, pinhole.cy = 19;
  all.push_back({"PINHOLE", pinhole});
  for (auto const& lens : gart_test::lenses()) all.push_back({lens.name, gart_test::camera_of(lens, 40)});
  gart::camera flat = pinhole;
  flat.kind = gart::camera_kind::orthographic, flat.fx = flat.fy = 7;
  all.push_back({"ORTHOGRAPHIC", flat});
  for (auto& [name, view] : all) {
    view.rotation = gart::to_matrix({normal(random), normal(random), normal(random), normal(random)});
    view.position = {10 * normal(random), 10 * normal(random), 10 * normal(random)};
  }
  for (std::size_t k = 0, still = all.size() - 1; k < still; ++k) {
    gart::camera c = all[k].view;
    c.shutter = shutters[k % 4], c.turn = {0.1f, -0.07f, 0.12f}, c.travel = {0.2f, 0.15f, -0.1f};
    all.push_back({all[k].name + " that rolls", c});
  }
  return all;
}

// Around the camera in every direction, with colours that depend on it.
gart::gaussian_model gaussians_around(gart::vec3d const& center, std::mt19937_64& random) {
  auto const uniform = [&](double lo, double hi) { return std::uniform_real_distribution<double>(lo, hi)(random); };
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(400, 2);
  for (std::size_t i = 0; i < m.size(); ++i) {
    double const far = 3 * std::exp(uniform(-1, 1)), size = far * std::exp(uniform(-4, -1));
    double d[3], norm = 0;
    for (double& v : d) v = normal(random), norm += v * v;
    for (std::size_t k = 0; k < 3; ++k) {
      m.mean[3 * i + k] = static_cast<float>(center[static_cast<int>(k)] + far * d[k] / std::sqrt(norm));
      m.log_scale[3 * i + k] = static_cast<float>(std::log(size) + uniform(-1.5, 0));
    }
    for (std::size_t k = 0; k < 4; ++k) m.quaternion[4 * i + k] = normal(random);
    m.opacity[i] = static_cast<float>(uniform(-3, 3));
  }
  for (float& c : m.sh) c = 0.4f * normal(random);
  return m;
}

gart::configuration_request by(gart::tracer_kind tracer, char const* backward) {
  gart::configuration_request out;
  out.backend = gart::backend_kind::openmp, out.tracer = tracer, out.backward = backward, out.sh_degree = 2;
  return out;
}

}  // namespace

TEST_CASE("images and gradients of all cameras match the reference") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::uniform_real_distribution<float> uniform(-1, 1);
  gart::render_options options;
  options.near = 0.05f;
  struct configured {
    std::string name;
    std::unique_ptr<gart::renderer> by;
  };
  std::vector<configured> ways;
  auto const add = [&](char const* name, gart::tracer_kind tracer, char const* backward) {
    ways.push_back({std::string(name) + ", " + backward, gart::make_renderer(by(tracer, backward))});
  };
  add("tiles", gart::tracer_kind::tiles, "primitive");
  add("tiles", gart::tracer_kind::tiles, "hybrid");
  add("bvh", gart::tracer_kind::bvh, "pixel");
#if defined(GART_WITH_EMBREE)
  add("embree", gart::tracer_kind::embree, "primitive");
#endif
  for (auto const& [name, view] : views(random)) {
    CAPTURE(name);
    auto const model = gaussians_around(view.position, random);
    auto const all = gart::all_pixels(view);
    auto const image = gart::trace_reference(model, view, options, 2, all);
    std::vector<double> by_color(3 * all.size());
    gart::image_float gradient(view.width, view.height, 3);
    gart::rendered first;
    for (configured const& way : ways) {
      CAPTURE(way.name);
      way.by->set_model(model);
      gart::rendered const got = way.by->render(view, options);
      if (&way == &ways.front()) {
        // A hit at a threshold may be decided otherwise in float: such a pixel counts neither way.
        std::size_t aside = 0;
        double worst = 0;
        first = got;
        for (std::size_t p = 0; p < all.size(); ++p) {
          bool const same = got.hits.data[p] == image.hits[p];
          aside += !same;
          for (std::size_t c = 0; c < 3; ++c) {
            if (same) worst = std::max(worst, std::abs(got.color.data[3 * p + c] - image.color[3 * p + c]));
            gradient.data[3 * p + c] = same ? uniform(random) : 0.0f;
            by_color[3 * p + c] = gradient.data[3 * p + c];
          }
        }
        CAPTURE(worst);
        CHECK(aside <= 2 + all.size() / 50);
        CHECK(worst < 1e-4);
      }
      CHECK(got.color.data == first.color.data);
      CHECK(got.transmittance.data == first.transmittance.data);
      CHECK(got.depth.data == first.depth.data);
      CHECK(got.hits.data == first.hits.data);
    }
    auto const expected = gart::trace_reference(model, view, options, 2, all, by_color).gradients;
    for (configured const& way : ways) {
      CAPTURE(way.name);
      way.by->differentiate(view, options, gradient);
      gart::gaussian_model const got = way.by->gradients();
      CHECK(gart_test::relative_error(got.mean, expected.mean) < 1e-4);
      CHECK(gart_test::relative_error(got.log_scale, expected.log_scale) < 1e-4);
      CHECK(gart_test::relative_error(got.quaternion, expected.quaternion) < 1e-4);
      CHECK(gart_test::relative_error(got.opacity, expected.opacity) < 1e-4);
      CHECK(gart_test::relative_error(got.sh, expected.sh) < 1e-4);
    }
  }
}

TEST_CASE("the reference filters pinholes and OpenCV lenses alone") {
  gart::camera c;
  c.kind = gart::camera_kind::fisheye, c.width = c.height = 4, c.fx = c.fy = 2, c.cx = c.cy = 2;
  gart::gaussian_model model;
  model.resize(0, 0);
  CHECK(gart::trace_reference(model, c, {}, 0, {5}).transmittance == std::vector<double>{1});
  gart::render_options filtered;
  filtered.antialias = 0.3f;
  CHECK_THROWS_WITH_AS(gart::trace_reference(model, c, filtered, 0, {5}), doctest::Contains("filter of pixels"),
                       gart::unsupported);
}
