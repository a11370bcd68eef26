// A renderer over memory that is not its own: the images and gradients of render() and differentiate(), the same bits.
#include <gart/io/image_file.hpp>
#include <gart/runtime/renderer.hpp>

#include <support/policies.hpp>

#include <limits>
#include <random>
#include <utility>
#include <vector>

namespace {

using gart::index_t;
using gart::u32;
using gart::u8;

gart::gaussian_model cloud(std::uint64_t seed, int sh_degree, std::size_t count = 80) {
  std::mt19937_64 engine(seed);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(count, sh_degree);
  for (auto& x : m.mean) x = 0.5f * normal(engine);
  for (auto& x : m.log_scale) x = -1.7f + 0.3f * normal(engine);
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.opacity) x = normal(engine);
  for (auto& x : m.sh) x = 1.5f * normal(engine);  // some colours beyond white
  return m;
}

gart::camera some_view() {
  gart::camera view;
  view.width = 37, view.height = 22;
  view.fx = view.fy = 30, view.cx = 18, view.cy = 11;
  view.position.z = -4;
  return view;
}

// Sums in a fixed order where the policy has them, so that bits can be compared.
template <class E>
gart::configuration_request request_of(E& exec, int sh_degree) {
  gart::configuration_request request;
  request.backend = gart::from_string<gart::backend_kind>(E::name);
  request.tracer = E::device ? gart::tracer_kind::tiles : gart::tracer_kind::automatic;
  request.backward = E::device ? "deterministic" : "primitive";
  request.sh_degree = sh_degree;
  request.threads = 1;
  if constexpr (E::device) request.stream = exec.stream();
  return request;
}

bool same_bits(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.sh_degree == b.sh_degree && a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion &&
         a.opacity == b.opacity && a.sh == b.sh;
}

}  // namespace

TEST_CASE_TEMPLATE("a view in memory of the policy is the view on the host", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::camera const view = some_view();
  index_t const pixels = static_cast<index_t>(view.width) * view.height;
  gart::render_options options;
  options.background = gart::vec3(0.2f, 0.4f, 0.9f);
  for (int const degree : {0, 1, 2, 3}) {
    CAPTURE(degree);
    auto const renderer = gart::make_renderer(request_of(exec, degree));
    renderer->set_model(cloud(seed, degree));
    gart::rendered const expected = renderer->render(view, options);

    gart::buffer<float, E> color(exec, 3 * pixels), transmittance(exec, pixels), depth(exec, pixels);
    gart::buffer<u32, E> hits(exec, pixels);
    gart::buffer<u8, E> rgba(exec, 4 * pixels), bytes_alone(exec, 4 * pixels);
    renderer->render_to(view, options, {color.data(), transmittance.data(), depth.data(), hits.data(), rgba.data()});
    renderer->wait();
    CHECK(color.to_host() == expected.color.data);
    CHECK(transmittance.to_host() == expected.transmittance.data);
    CHECK(depth.to_host() == expected.depth.data);
    CHECK(hits.to_host() == expected.hits.data);

    gart::image8 const rounded = gart::to_8bit(expected.color);
    std::vector<u8> wanted(4 * pixels, 255);
    for (index_t i = 0; i < pixels; ++i)
      for (int c = 0; c < 3; ++c) wanted[4 * i + c] = rounded.data[3 * i + c];
    CHECK(rgba.to_host() == wanted);
    gart::image8 const alone = renderer->render_8bit(view, options);
    CHECK(alone.width == view.width);
    CHECK(alone.height == view.height);
    CHECK(alone.channels == 3);
    CHECK(alone.data == rounded.data);
    gart::render_targets screen;
    screen.rgba = bytes_alone.data();
    renderer->render_to(view, options, screen);
    renderer->wait();
    CHECK(bytes_alone.to_host() == wanted);
  }
}

TEST_CASE_TEMPLATE("Gaussians of another owner are rendered as one's own", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::camera const view = some_view();
  index_t const pixels = static_cast<index_t>(view.width) * view.height;
  gart::gaussian_model const model = cloud(seed, 1), other = cloud(seed + 1, 1);
  auto const own = gart::make_renderer(request_of(exec, 1)), bound = gart::make_renderer(request_of(exec, 1));
  own->set_model(model);
  gart::gaussians<E> scene(exec, other), gradients(exec, scene.size(), 1);
  bound->set_model(other);
  bound->bind(std::as_const(scene).view());
  gart::rendered const before = bound->render(view, {});
  CHECK(before.color.data != own->render(view, {}).color.data);
  scene.assign(model);  // what is written there counts
  bound->bind(std::as_const(scene).view());
  gart::rendered const image = bound->render(view, {});
  CHECK(image.color.data == own->render(view, {}).color.data);

  own->differentiate(view, {}, image.color);
  gart::buffer<float, E> color_gradient(exec), color(exec, 3 * pixels);
  color_gradient.assign(gart::span<float const>(image.color.data));
  std::vector<float> const wrong(gradients.sh.size(), std::numeric_limits<float>::quiet_NaN());
  gradients.sh.assign(wrong);  // is overwritten
  gart::render_targets targets;
  targets.color = color.data();
  bound->differentiate_into(view, {}, color_gradient.data(), gradients.view(), targets);
  bound->wait();
  CHECK(same_bits(gradients.to_host(), own->gradients()));
  CHECK(color.to_host() == image.color.data);
  auto const turned = [](gart::renderer& r) { return r.differentiate_pose().rotation; };
  gart::vec3d const rotation = turned(*own);

  auto const context = bound->forward(view, {}, targets);  // in two calls the same, with another view in between
  bound->render_to(view, {}, targets);
  gradients.sh.assign(wrong);
  gart::buffer<float, E> pose(exec, gart::pose_gradient::floats);
  context->backward({.color = color_gradient}, {.gaussians = gradients.view(), .pose = pose.data()});
  bound->wait();
  CHECK(same_bits(gradients.to_host(), own->gradients()));
  CHECK(gart::pose_gradient(pose.to_host().data()).rotation == rotation);

  gart::gaussians<E> const of_another_degree(exec, cloud(seed, 2));
  CHECK_THROWS_AS(bound->bind(of_another_degree.view()), gart::invalid_argument);
  gart::gaussians<E> too_few(exec, scene.size() - 1, 1);
  CHECK_THROWS_AS(bound->differentiate_into(view, {}, color_gradient.data(), too_few.view()), gart::invalid_argument);
  gart::render_options options;
  options.rebuild_every = 2;
  if (bound->configuration().tracer != gart::tracer_kind::bvh)
    CHECK_THROWS_AS(bound->render_to(view, options, {}), gart::invalid_argument);
}
