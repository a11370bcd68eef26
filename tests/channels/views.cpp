// Features of views behind the run-time interface: those of the view's rays as a batch, for every camera; their
// gradients; what a model's own are, and what is refused.
#include <gart/runtime/ray_service.hpp>
#include <gart/runtime/renderer.hpp>

#include <rays/view_rays.hpp>
#include <support/refused.hpp>

#include <cmath>
#include <utility>

using namespace gart_test;
using gart::index_t;

namespace {

template <class E>
gart::configuration_request request_of(E& exec, int sh_degree) {
  gart::configuration_request request;
  request.backend = gart::from_string<gart::backend_kind>(E::name);
  request.tracer = E::device ? gart::tracer_kind::tiles : gart::tracer_kind::automatic;
  request.backward = E::device ? "deterministic" : "primitive";
  request.sh_degree = sh_degree, request.threads = 1;
  if constexpr (E::device) request.stream = exec.stream();
  return request;
}

gart::gaussian_model featured(std::uint64_t seed, int sh_degree, std::size_t count, int width) {
  gart::gaussian_model m = cloud(seed, sh_degree, count);
  std::mt19937_64 engine(seed + 3);
  std::normal_distribution<float> normal;
  m.feature_count = width, m.resize(count, sh_degree);
  for (float& x : m.features) x = normal(engine);
  return m;
}

double difference(std::vector<float> const& a, std::vector<float> const& b) {
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    error += double{a[i] - b[i]} * double{a[i] - b[i]}, norm += double{b[i]} * double{b[i]};
  return std::sqrt(error / norm);
}

}  // namespace

TEST_CASE_TEMPLATE("features of a view are those of its rays, for every camera", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model const model = featured(seed, 2, 200, 9);
  index_t const count = static_cast<index_t>(model.size());
  for (gart::tracer_kind const kind : {gart::tracer_kind::tiles, gart::tracer_kind::bvh}) {
    gart::configuration_request request = request_of(exec, 2);
    request.tracer = kind;
    // Of the hosts' policies one has lists of tiles compiled, and memory is the same.
    if (!E::device && kind == gart::tracer_kind::tiles) request.backend = gart::backend_kind::openmp;
    auto const renderer = gart::make_renderer(request);
    renderer->set_model(model);
    for (auto const& [name, view] : cameras()) {
      CAPTURE(name);
      std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
      auto const picture = trace_view<gart::bvh_tracer<E>>(exec, model, view, {}, 2);
      batch_memory<E> const batch(exec, view.position, picture.origins, picture.directions);
      gart::buffer<float, E> of_view(exec, 9 * pixels), of_rays(exec, 9 * pixels), color(exec, 3 * pixels);
      gart::buffer<gart::u32, E> hits(exec, pixels);
      gart::batch_targets rays_to;
      rays_to.channels.features = of_rays.data();
      renderer->trace_to(batch.rays(), {}, rays_to);
      gart::render_targets to;
      to.color = color.data(), to.hits = hits.data(), to.channels.features = of_view.data();
      renderer->render_to(view, {}, to);
      renderer->wait();
      CHECK(of_view.to_host() == of_rays.to_host());
      CHECK(color.to_host() == picture.color);
      CHECK(hits.to_host() == picture.hits);
      auto const image = renderer->render(view, {}, true);
      CHECK(image.features.channels == 9);
      CHECK(image.features.data == of_view.to_host());

      // And back, to features and geometry.
      gart::buffer<float, E> by(exec, 9 * pixels), view_features(exec, 9 * model.size()),
          ray_features(exec, 9 * model.size());
      by.assign(of_view.to_host());
      gart::output_gradients by_both;
      by_both.channels.features = by;
      gart::gaussians<E> a(exec, count, 2), b(exec, count, 2);
      of_view.zero(), hits.zero();
      auto const of_the_view = renderer->forward(view, {}, to);
      auto const of_the_rays = renderer->forward(batch.rays(), {}, gart::batch_targets{});
      for (int again = 0; again < 2; ++again) {
        of_the_view->backward(by_both, {.gaussians = a.view(), .channels = {{view_features.data(), count, 9}}});
        of_the_rays->backward(by_both, {.gaussians = b.view(), .channels = {{ray_features.data(), count, 9}}});
        renderer->wait();
        CHECK(of_view.to_host() == of_rays.to_host());
        CHECK(hits.to_host() == picture.hits);
        CHECK(view_features.to_host() == ray_features.to_host());
        gart::gaussian_model const x = a.to_host(), y = b.to_host();
        CHECK(difference(x.mean, y.mean) < 1e-5);
        CHECK(difference(x.log_scale, y.log_scale) < 1e-5);
        CHECK(difference(x.quaternion, y.quaternion) < 1e-5);
        CHECK(difference(x.opacity, y.opacity) < 1e-5);
        CHECK(x.sh == std::vector<float>(x.sh.size()));
      }
    }
  }
}

TEST_CASE_TEMPLATE("a feature of one is what a view does not let through", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model model = featured(seed, 1, 200, 1);
  for (float& x : model.features) x = 1;
  auto const renderer = gart::make_renderer(request_of(exec, 1));
  renderer->set_model(model);
  gart::camera const view = cameras()[0].second;
  std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
  gart::render_options filtered, rows;
  filtered.antialias = 0.4f, rows.rows = {8, 16};
  for (gart::render_options const& options : {gart::render_options(), filtered, rows}) {
    gart::buffer<float, E> features(exec, pixels);
    gart::render_targets to;
    to.channels.features = features.data();
    renderer->render_to(view, options, to);
    renderer->wait();
    auto const got = features.to_host();
    auto const left = renderer->render(view, options).transmittance;
    double worst = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
      int const row = static_cast<int>(i) / view.width;
      double const expected = options.rows.contains(row) ? 1 - double{left.data[i]} : 0;
      worst = std::max(worst, std::abs(double{got[i]} - expected));
    }
    CHECK(worst < 1e-5);
  }
}

TEST_CASE_TEMPLATE("features are the model's until others are bound", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model const model = featured(3, 0, 100, 2);
  random_rays const some(4, 80, 1.0f);
  gart::ray_batch const on_host{{}, some.origins, some.directions, {}};
  auto const renderer = gart::make_renderer(request_of(exec, 0));
  renderer->set_model(model);
  auto const own = renderer->trace(on_host, {}, true);
  CHECK(own.features.size() == 160);
  CHECK(renderer->trace(on_host, {}).features.empty());
  gart::buffer<float, E> more(exec, std::vector<float>(300, 2.0f));
  renderer->bind_channels({{more.data(), 100, 3}});
  auto const bound = renderer->trace(on_host, {}, true);
  CHECK(bound.color == own.color);
  REQUIRE(bound.features.size() == 240);
  for (std::size_t i = 0; i < 80; ++i)
    CHECK(std::abs(bound.features[3 * i] - 2 * (1 - bound.transmittance[i])) < 1e-5f);
  more.zero();
  CHECK(renderer->trace(on_host, {}, true).features == std::vector<float>(240));

  refused([&] { renderer->bind_channels({{more.data(), 99, 3}}); }, "renderer.bind_channels: feature_view.count is 99");
  gart::gaussian_model wrong = model;
  wrong.features.pop_back();
  refused([&] { renderer->set_model(wrong); }, "gaussian_model.features has 199 numbers");
  gart::gaussians<E> const scene(exec, model);
  renderer->bind(scene.view());
  CHECK(renderer->trace(on_host, {}, true).features.empty());
  gart::camera const view = cameras()[0].second;
  CHECK(renderer->render(view, {}, true).features.data.empty());
  gart::render_targets to;
  to.channels.features = more.data();
  refused([&] { renderer->render_to(view, {}, to); }, "renderer.render_to: channel_targets.features is set");
  refused([&] { renderer->forward(view, {}, to); }, "renderer.forward: channel_targets.features is set");
}
