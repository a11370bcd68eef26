// Batches of rays and contexts of forward passes behind the run-time interface: the numbers of the templates, whatever
// runs in between.
#include <gart/instances/instance_set.hpp>
#include <gart/runtime/instances.hpp>
#include <gart/runtime/ray_service.hpp>
#include <gart/runtime/renderer.hpp>

#include <rays/view_rays.hpp>
#include <support/refused.hpp>

#include <algorithm>
#include <utility>

using namespace gart_test;
using gart::index_t;

namespace {

// Sums in a fixed order where the policy has them, so that bits can be compared.
template <class E>
gart::configuration_request request_of(E& exec, int sh_degree, bool depth = false) {
  gart::configuration_request request;
  request.backend = gart::from_string<gart::backend_kind>(E::name);
  request.tracer = E::device ? gart::tracer_kind::tiles : gart::tracer_kind::automatic;
  request.backward = E::device ? "deterministic" : "primitive";
  if (depth) {
    // Of the hosts' policies one has it compiled, and memory is the same.
    if (!E::device) request.backend = gart::backend_kind::openmp;
    request.tracer = gart::tracer_kind::tiles, request.backward = "primitive";
  }
  request.depth = depth, request.sh_degree = sh_degree, request.threads = 1;
  if constexpr (E::device) request.stream = exec.stream();
  return request;
}

gart::camera view_at(double x) {
  gart::camera view;
  view.width = 33, view.height = 21;
  view.fx = view.fy = 28, view.cx = 16, view.cy = 10;
  view.position = gart::vec3d(x, 0, -4);
  return view;
}

bool same_bits(gart::gaussian_model const& a, gart::gaussian_model const& b) {
  return a.sh_degree == b.sh_degree && a.mean == b.mean && a.log_scale == b.log_scale && a.quaternion == b.quaternion &&
         a.opacity == b.opacity && a.sh == b.sh;
}

double difference(std::vector<float> const& a, std::vector<float> const& b) {
  double error = 0, norm = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    error += double{a[i] - b[i]} * double{a[i] - b[i]}, norm += double{b[i]} * double{b[i]};
  return std::sqrt(error / norm);
}

// By name: nvcc loses the braces of a list of one.
gart::output_gradients by_image(gart::span<float const> color, gart::span<float const> depth = {}) {
  gart::output_gradients by;
  by.color = color, by.depth = depth;
  return by;
}

}  // namespace

TEST_CASE_TEMPLATE("a renderer traces rays as the template does", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  random_rays const some(seed + 1, 200, 1.0f);
  std::vector<float> const ends(200, 3.0f);
  gart::ray_batch const on_host{{0.5, 0, 0}, some.origins, some.directions, ends};
  batch_memory<E> const batch(exec, on_host.frame, some.origins, some.directions, ends);
  gart::render_options options;
  options.background = gart::vec3(0.2f);
  for (int const degree : {0, 1, 2, 3})
    for (bool const bound : {false, true}) {
      CAPTURE(degree);
      CAPTURE(bound);
      gart::gaussian_model const model = cloud(seed, degree, 150);
      gart::gaussians<E> const scene(exec, model);
      gart::ray_tracer<E> tracer(exec);
      tracer.set_scene(scene.view(), degree);
      auto const expected = trace_all(exec, tracer, batch.rays(), options);

      auto const renderer = gart::make_renderer(request_of(exec, degree));
      bound ? renderer->bind(scene.view()) : renderer->set_model(model);
      CHECK(same(renderer->trace(on_host, options), expected));
      target_memory<E> out(exec, 200);
      renderer->trace_to(batch.rays(), options, out.targets());
      renderer->wait();
      CHECK(same(out.to_host(), expected));
      gart::hit_lists const lists = renderer->list_hits(on_host, options),
                            wanted = tracer.list(batch.rays(), options).to_host();
      CHECK(lists.offsets == wanted.offsets);
      CHECK(lists.ids == wanted.ids);
      CHECK(lists.t == wanted.t);

      gart::gaussians<E> got(exec, scene.size(), degree), by_template(exec, scene.size(), degree);
      gart::buffer<float, E> const by_color(exec, some.origins), by_depth(exec, ends);
      auto left = tracer.forward(batch.rays(), options);
      tracer.backward(left, {by_color, by_depth}, by_template.view());
      auto const context = renderer->forward(batch.rays(), options, gart::batch_targets{});
      renderer->render(view_at(0), {});
      context->backward({by_color, by_depth}, {.gaussians = got.view()});
      renderer->wait();
      CHECK(same_bits(got.to_host(), by_template.to_host()));
      refused([&] { context->backward({by_color}, {.pose = out.depth.data()}); }, "a batch has no pose");
      renderer->set_model(model);
      refused([&] { context->backward({by_color}, {.gaussians = got.view()}); }, "another model was set or bound");
    }
}

TEST_CASE_TEMPLATE("bound arrays that change are seen by batches", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model model = cloud(8, 1, 100);
  gart::gaussians<E> scene(exec, model);
  random_rays const some(9, 100, 1.0f);
  gart::ray_batch const on_host{{}, some.origins, some.directions, {}};
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);
  auto const renderer = gart::make_renderer(request_of(exec, 1)), fresh = gart::make_renderer(request_of(exec, 1));
  renderer->bind(std::as_const(scene).view());
  auto const before = renderer->trace(on_host, {});
  auto const context = renderer->forward(batch.rays(), {}, gart::batch_targets{});
  for (auto& x : model.mean) x += 0.2f;
  scene.assign(model);
  fresh->set_model(model);
  auto const after = renderer->trace(on_host, {});
  CHECK(!same(after, before));
  CHECK(same(after, fresh->trace(on_host, {})));
  gart::gaussians<E> gradients(exec, scene.size(), 1);
  gart::buffer<float, E> const by_color(exec, some.origins);
  refused([&] { context->backward({by_color}, {.gaussians = gradients.view()}); }, "have changed since forward()");
}

TEST_CASE_TEMPLATE("a renderer shows scenes of instances", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  std::vector<gart::gaussian_model> models{cloud(seed, 1, 90), cloud(seed + 1, 1, 40)};
  models[0].feature_count = models[1].feature_count = 2;
  for (auto& m : models) m.features.assign(2 * m.size(), 0.5f);
  std::vector<gart::instance> instances{
      {0}, {1, gart::turn_of({0.1, 0.8, 0}), {1, 0, 0}}, {1, gart::mat3d(1.0), {-1, 0, 0}}};
  auto const request = request_of(exec, 1);
  auto const actors = gart::make_instances(request);
  auto const renderer = gart::make_renderer(request);
  random_rays const some(seed + 2, 200, 1.0f);
  gart::ray_batch const on_host{{}, some.origins, some.directions, {}};
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);

  gart::gaussians<E> const first(exec, models[0]), second(exec, models[1]);
  gart::instance_set<E> set(exec, 1);
  gart::ray_tracer<E> tracer(exec);
  set.set({first.view(), second.view()}, instances);
  actors->set_models(models, instances);
  renderer->bind(actors->scene());
  renderer->bind_channels({actors->features()});
  for (int step = 0; step < 2; ++step) {
    CAPTURE(step);
    actors->wait();
    tracer.set_scene(set.scene(), 1);
    gart::traced_rays const got = renderer->trace(on_host, {}, true);
    CHECK(same(got, trace_all(exec, tracer, batch.rays(), {})));
    for (std::size_t r = 0; r < 200; ++r)
      CHECK(got.features[2 * r] == doctest::Approx(0.5f * (1 - got.transmittance[r])).epsilon(1e-4));
    instances[1].position.y += 0.3;
    actors->move(instances), set.move(instances);
  }
  CHECK(actors->of(130).instance == 2);
  CHECK(actors->of(130).gaussian == 0);
  refused([&] { actors->of(170); }, "has 170 Gaussians, and none of number 170");

  // From a view to models and poses.
  gart::image_float const by = renderer->render(view_at(0), {}).color;
  gart::buffer<float, E> by_color(exec), poses(exec, 18), expected(exec, 18);
  by_color.assign(gart::span<float const>(by.data.data(), by.data.size()));
  gart::gaussians<E> by_scene(exec, 170, 1), by_second(exec, 40, 1), by_first(exec, 90, 1);
  renderer->forward(view_at(0), {}, gart::render_targets{})
      ->backward(by_image(by_color), {.gaussians = by_scene.view()});
  renderer->wait();
  std::vector<gart::gaussians_view<float>> const targets{by_first.view(), by_second.view()};
  gart::instance_gradients to;
  to.models = targets, to.poses = poses.data();
  actors->backward(std::as_const(by_scene).view(), to);
  actors->wait();
  gart::gaussian_model const got = by_second.to_host();
  to.poses = expected.data();
  set.backward(std::as_const(by_scene).view(), to);
  CHECK(same_bits(by_second.to_host(), got));
  CHECK(poses.to_host() == expected.to_host());
  CHECK(*std::max_element(got.mean.begin(), got.mean.end()) > 0);

  models[1].opacity.pop_back();
  refused([&] { actors->set_models(models, instances); }, "instance_scene.set_models: gaussian_model.");
  refused([&] { actors->bind_models({{nullptr, nullptr, nullptr, nullptr, nullptr, 3, 1}}, {{}}); }, "is null");
  auto no_backend = request;
  no_backend.backend = gart::backend_kind::automatic;
  CHECK_THROWS_WITH_AS(gart::make_instances(no_backend), doctest::Contains("there are: "), gart::unsupported);
}

TEST_CASE_TEMPLATE("contexts of views wait for their gradients side by side", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (int const degree : {1, 3}) {
    CAPTURE(degree);
    gart::gaussian_model const model = cloud(seed, degree, 120);
    auto const renderer = gart::make_renderer(request_of(exec, degree));
    renderer->set_model(model);
    index_t const count = static_cast<index_t>(model.size()), pixels = 33 * 21;
    std::vector<std::unique_ptr<gart::forward_context>> contexts;
    std::vector<gart::image_float> images;
    for (double const x : {0.0, 0.7, -0.4}) {
      gart::buffer<float, E> color(exec, 3 * pixels);
      gart::render_targets targets;
      targets.color = color.data();
      contexts.push_back(renderer->forward(view_at(x), {}, targets));
      renderer->wait();
      images.push_back(renderer->render(view_at(x), {}).color);
      CHECK(color.to_host() == images.back().data);
    }
    std::size_t k = 0;
    for (double const x : {0.0, 0.7, -0.4}) {
      CAPTURE(x);
      gart::gaussians<E> got(exec, count, degree);
      gart::buffer<float, E> pose(exec, 6), by_color(exec);
      by_color.assign(gart::span<float const>(images[k].data.data(), images[k].data.size()));
      for (int again = 0; again < 2; ++again) {
        contexts[k]->backward(by_image(by_color), {.gaussians = got.view(), .pose = pose.data()});
        renderer->wait();
        auto const pose_got = pose.to_host();
        renderer->differentiate(view_at(x), {}, images[k]);
        CHECK(same_bits(got.to_host(), renderer->gradients()));
        auto const expected = renderer->differentiate_pose();
        CHECK(gart::pose_gradient(pose_got.data()).translation == expected.translation);
        CHECK(gart::pose_gradient(pose_got.data()).rotation == expected.rotation);
      }
      // The pose alone.
      auto const pose_before = pose.to_host();
      contexts[k]->backward(by_image(by_color), {.pose = pose.data()});
      renderer->wait();
      CHECK(pose.to_host() == pose_before);
      ++k;
    }
    gart::gaussians<E> out(exec, count, degree);
    gart::buffer<float, E> const by(exec, 3 * pixels), one(exec, pixels);
    gart::output_gradients of_features = by_image(by);
    of_features.channels.features = one;
    refused([&] { contexts[0]->backward(by_image(one), {.gaussians = out.view()}); }, "output_gradients.color has 693");
    refused([&] { contexts[0]->backward(of_features, {.gaussians = out.view()}); }, "the Gaussians have none");
    refused(
        [&] {
          contexts[0]->backward(by_image(by), {.rays = {out.mean.data(), nullptr}});
        },
        "trace them as a batch");
    renderer->set_model(model);
    refused([&] { contexts[0]->backward(by_image(by), {.gaussians = out.view()}); }, "another model was set or bound");
  }
}

TEST_CASE_TEMPLATE("gradients of depth: a view's and its rays' agree", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model const model = cloud(seed, 3, 120);
  gart::camera const view = view_at(0.2);
  index_t const count = static_cast<index_t>(model.size());
  auto const picture = trace_view<gart::bvh_tracer<E>>(exec, model, view, {}, 3);
  batch_memory<E> const batch(exec, view.position, picture.origins, picture.directions);
  gart::buffer<float, E> const by_color(exec, picture.directions), by_depth(exec, picture.transmittance),
      by_transmittance(exec, picture.depth);
  gart::output_gradients const by{by_color, by_depth, by_transmittance};
  // By the method's own pass, and over the hits where it has none.
  for (bool const fused : {true, false}) {
    CAPTURE(fused);
    auto const renderer = gart::make_renderer(request_of(exec, 3, fused));
    CHECK(renderer->configuration().depth == fused);
    renderer->set_model(model);
    gart::gaussians<E> of_view(exec, count, 3), of_rays(exec, count, 3);
    renderer->forward(view, {}, gart::render_targets{})->backward(by, {.gaussians = of_view.view()});
    renderer->forward(batch.rays(), {}, gart::batch_targets{})->backward(by, {.gaussians = of_rays.view()});
    renderer->wait();
    gart::gaussian_model const a = of_view.to_host(), b = of_rays.to_host();
    CHECK(difference(b.mean, a.mean) < 1e-4);
    CHECK(difference(b.log_scale, a.log_scale) < 1e-4);
    CHECK(difference(b.quaternion, a.quaternion) < 1e-4);
    CHECK(difference(b.opacity, a.opacity) < 1e-4);
    CHECK(difference(b.sh, a.sh) < 1e-4);
  }
}

TEST_CASE_TEMPLATE("rays of a response that is not compiled are refused", E, GART_TEST_POLICIES) {
  gart::configuration_request request;
  request.backend = gart::from_string<gart::backend_kind>(E::name);
  request.kernel_degree = 4;
  CHECK_THROWS_WITH_AS(gart::make_ray_service(request), doctest::Contains("kernel degree 4; there are: "),
                       gart::unsupported);
}
