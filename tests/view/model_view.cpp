// Views of a model and of what a crop box leaves are those of a renderer that holds the same Gaussians.
#include "cameras.hpp"

#include <gart/io/image_file.hpp>
#include <gart/runtime/renderer.hpp>
#include <gart/view/model_view.hpp>

#include <doctest/doctest.h>

#include <random>

namespace {

gart::gaussian_model cloud() {
  std::mt19937_64 engine(3);
  std::normal_distribution<float> normal;
  gart::gaussian_model m;
  m.resize(120, 1);
  for (auto& x : m.mean) x = 0.5f * normal(engine);
  for (auto& x : m.log_scale) x = -1.7f + 0.3f * normal(engine);
  for (auto& x : m.quaternion) x = normal(engine);
  for (auto& x : m.opacity) x = normal(engine);
  for (auto& x : m.sh) x = normal(engine);
  return m;
}

gart::configuration_request request() {
  gart::configuration_request r;
  r.backend = gart::backend_kind::serial, r.sh_degree = 1;
  return r;
}

}  // namespace

TEST_CASE("a crop box, another one, none, and one that leaves nothing") {
  gart::gaussian_model const m = cloud();
  gart::camera const view = gart_test::camera_at({0, 0, -3}, 0, 32, 24);
  gart::render_options options;
  options.background = gart::vec3(0.2f, 0.4f, 0.6f);
  auto const shown = gart::make_renderer(request()), alone = gart::make_renderer(request());
  gart::view_render const render = gart::render_of(*shown, m, options);
  auto const expected = [&](gart::gaussian_model const& part, float near) {
    alone->set_model(part);
    gart::render_options o = options;
    o.near = near;
    return alone->render(view, o).color.data;
  };
  gart::view_box const left{{-10, -10, -10}, {0, 10, 10}}, right{{0, -10, -10}, {10, 10, 10}},
      nowhere{{5, 5, 5}, {6, 6, 6}};
  auto const of = [&](std::optional<gart::view_box> crop, std::optional<float> near = {}) {
    gart::view_settings settings;
    settings.crop = crop, settings.near = near;
    auto const image = render.images(view, settings);
    CHECK(render.colours(view, settings).data == gart::to_8bit(image.color).data);
    return image.color.data;
  };
  CHECK(of({}) == expected(m, options.near));
  CHECK(of(left) == expected(gart::cropped(m, left), options.near));
  CHECK(of(right) == expected(gart::cropped(m, right), options.near));
  CHECK(of(left) != of({}));
  CHECK(of({}, 3.0f) == expected(m, 3.0f));
  CHECK(of({}, 3.0f) != of({}));
  gart::view_settings in_nothing;
  in_nothing.crop = nowhere;
  auto const empty = render.images(view, in_nothing);
  CHECK(empty.color.at(3, 4, 1) == 0.4f);
  CHECK(empty.transmittance.at(3, 4, 0) == 1);
  CHECK(of({}) == expected(m, options.near));
}
