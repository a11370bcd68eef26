// What a renderer refuses: arrays that disagree, and the pose of a view that is not the one that was differentiated.
#include <gart/runtime/renderer.hpp>

#include <support/policies.hpp>
#include <support/refused.hpp>

#include <utility>
#include <vector>

using gart_test::refused;

namespace {

template <class E>
gart::configuration_request request_of() {
  gart::configuration_request request;
  request.backend = gart::from_string<gart::backend_kind>(E::name);
  request.sh_degree = 1;
  return request;
}

gart::gaussian_model three() {
  gart::gaussian_model m;
  m.resize(3, 1);
  for (std::size_t i = 0; i < 3; ++i) m.mean[3 * i] = 0.3f * static_cast<float>(i), m.quaternion[4 * i] = 1;
  for (auto& x : m.log_scale) x = -1;
  for (auto& x : m.sh) x = 0.4f;
  return m;
}

gart::camera some_view() {
  gart::camera view;
  view.width = 20, view.height = 16;
  view.fx = view.fy = 20, view.cx = 10, view.cy = 8;
  view.position.z = -4;
  return view;
}

}  // namespace

TEST_CASE_TEMPLATE("arrays that disagree are refused by name", E, GART_TEST_POLICIES) {
  auto const renderer = gart::make_renderer(request_of<E>());
  auto const short_of = [&](auto member, char const* what) {
    gart::gaussian_model m = three();
    (m.*member).pop_back();
    refused([&] { renderer->set_model(m); }, what);
  };
  short_of(&gart::gaussian_model::mean, "gaussian_model.mean has 8 numbers");
  short_of(&gart::gaussian_model::log_scale, "gaussian_model.log_scale has 8 numbers");
  short_of(&gart::gaussian_model::quaternion, "gaussian_model.quaternion has 11 numbers");
  short_of(&gart::gaussian_model::sh, "gaussian_model.sh has 35 numbers");
  short_of(&gart::gaussian_model::opacity, "and 2 opacities");

  E exec;
  gart::gaussians<E> const scene(exec, three());
  gart::gaussians_view<float const> arrays = scene.view();
  arrays.quaternion = nullptr;
  refused([&] { renderer->bind(arrays); }, "gaussians_view.quaternion is null");
  // The model that was there is there still.
  renderer->set_model(three());
  gart::rendered const before = renderer->render(some_view(), {});
  refused([&] { renderer->bind(arrays); }, "renderer.bind");
  CHECK(renderer->render(some_view(), {}).color.data == before.color.data);
}

TEST_CASE("a tracer that is not in the build is refused by name") {
  gart::configuration_request request;
  request.tracer = gart::tracer_kind::optix;
  CHECK_THROWS_WITH_AS(gart::make_renderer(request), doctest::Contains("-DGART_OPTIX=ON"), gart::unsupported);
}

TEST_CASE_TEMPLATE("a pose's gradient is of the view that was differentiated", E, GART_TEST_POLICIES) {
  auto const renderer = gart::make_renderer(request_of<E>());
  gart::camera const view = some_view();
  gart::camera other = view;
  other.position.x = 0.5;
  gart::image_float by_color(view.width, view.height, 3);
  for (std::size_t i = 0; i < by_color.data.size(); ++i) by_color.data[i] = i % 5 ? 0.1f : -0.2f;
  auto const pose = [&] { return renderer->differentiate_pose(); };

  renderer->set_model(three());
  refused(pose, "call renderer.differentiate first");
  renderer->differentiate(view, {}, by_color);
  CHECK_NOTHROW(pose());
  renderer->render(other, {});
  refused(pose, "another view was rendered");
  renderer->differentiate(view, {}, by_color);
  renderer->set_model(three());
  refused(pose, "call renderer.differentiate first");

  renderer->set_model(gart::with_sh_degree({}, 1));
  renderer->differentiate(view, {}, by_color);
  refused(pose, "no Gaussians");
}
