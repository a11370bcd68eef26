// N features of rays, and their gradients: against a tracer in double and its central differences, at the seams of the
// chunks that they are summed in.
#include <rays/sweep.hpp>
#include <support/refused.hpp>

using namespace gart_test;
using gart::gradient_form;
using gart::index_t;

namespace {

gart::gaussian_model featured_cloud(std::uint64_t seed, int sh_degree, std::size_t count, int features) {
  gart::gaussian_model m = cloud(seed, sh_degree, count);
  std::mt19937_64 engine(seed + 7);
  std::normal_distribution<float> normal;
  m.feature_count = features, m.resize(count, sh_degree);
  for (float& x : m.features) x = normal(engine);
  return m;
}

template <class E>
struct featured_scene {
  featured_scene(E& exec, gart::gaussian_model const& m) : scene(exec, m), features(exec, m.features) {
    channels.features = {features.data(), scene.size(), m.feature_count};
  }
  void give_to(gart::ray_tracer<E>& tracer) {
    tracer.set_scene(scene.view(), scene.sh_degree());
    tracer.set_channels(channels);
  }
  gart::gaussians<E> scene;
  gart::buffer<float, E> features;
  gart::gaussian_channels channels;
};

// The relative difference of numbers and those of the oracle.
double off(std::vector<float> const& got, std::vector<double> const& expected) {
  comparison c;
  REQUIRE(got.size() == expected.size());
  for (std::size_t i = 0; i < got.size(); ++i) c.add(double{got[i]}, expected[i]);
  return c.relative();
}

}  // namespace

TEST_CASE_TEMPLATE("any number of features and their gradients", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (int const width : {1, 7, 16, 32, 33, 128, 512}) {
    CAPTURE(width);
    std::size_t const n = static_cast<std::size_t>(width), rays = 150;
    gart::gaussian_model const model = featured_cloud(seed, 1, 130, width);
    sweep const s(seed + 1, rays, n);
    featured_scene<E> scene(exec, model);
    traced_sweep<E> traced(exec, s);
    gart::ray_tracer<E> tracer(exec);
    scene.give_to(tracer);
    gart::render_options options = sweep_options();
    options.max_hits = width == 7 ? 3 : 0;

    // Each ray by itself in double: a hit's weight goes to its Gaussian's features, and back.
    double_model const exact(model);
    std::vector<double> sums(rays * n), gradient(model.size() * n);
    for (std::size_t r = 0; r < rays; ++r)
      for (auto const& [id, weight] : see(exact, s.ray(r), s.weights(r), options).weights)
        for (std::size_t c = 0; c < n; ++c) {
          sums[r * n + c] += weight * exact.features[id * n + c];
          gradient[id * n + c] += weight * double{s.by_features[r * n + c]};
        }

    gart::buffer<float, E> shown(exec, rays * n), again(exec, rays * n);
    gart::batch_targets out;
    out.channels.features = shown.data();
    tracer.trace(traced.rays.rays(), options, out);
    CHECK(off(shown.to_host(), sums) < 1e-5);
    out.channels.features = again.data();
    auto context = tracer.forward(traced.rays.rays(), options, out);
    CHECK(again.to_host() == shown.to_host());
    gart::buffer<float, E> got(exec, model.size() * n), detached(exec, model.size() * n);
    tracer.backward(context, traced.by(), {}, {}, {{got.data(), scene.scene.size(), width}});
    CHECK(off(got.to_host(), gradient) < 1e-5);
    tracer.backward(context, traced.by(true), {}, {}, {{detached.data(), scene.scene.size(), width}});
    CHECK(detached.to_host() == got.to_host());
  }
}

TEST_CASE_TEMPLATE("gradients of 16 and 128 features are their differences", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (int const width : {16, 128}) {
    CAPTURE(width);
    gart::gaussian_model const model = featured_cloud(seed, 1, 40, width);
    sweep const s(seed + 1, 50, static_cast<std::size_t>(width));
    featured_scene<E> scene(exec, model);
    traced_sweep<E> traced(exec, s);
    gart::ray_tracer<E> tracer(exec);
    scene.give_to(tracer);
    for (gradient_form const form : {gradient_form::scatter, gradient_form::primitive}) {
      CAPTURE(static_cast<int>(form));
      auto context = tracer.forward(traced.rays.rays(), sweep_options(), {}, form);
      compare("features " + std::to_string(width), model, s, sweep_options(),
              traced.differentiate(tracer, context, scene.scene.size(), 1, width));
    }
  }
}

TEST_CASE_TEMPLATE("features that are detached leave the geometry alone", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  // Gaussians with more hits than a piece has, and some with none.
  gart::gaussian_model model = featured_cloud(seed, 1, 300, 5);
  for (std::size_t i = 0; i < 20; ++i) model.mean[3 * i] += 1000;
  sweep const s(seed + 1, 1500, 5);
  featured_scene<E> scene(exec, model);
  traced_sweep<E> traced(exec, s);
  gart::ray_tracer<E> tracer(exec);
  scene.give_to(tracer);
  index_t const count = scene.scene.size();
  auto context = tracer.forward(traced.rays.rays(), sweep_options());
  auto const attached = traced.differentiate(tracer, context, count, 1, 5);
  auto const detached = traced.differentiate(tracer, context, count, 1, 5, true);
  CHECK(attached.features == detached.features);
  CHECK(same_bits(attached.gaussians, traced.differentiate(tracer, context, count, 1, 5).gaussians));
  CHECK(attached.gaussians.sh == detached.gaussians.sh);
  CHECK(attached.gaussians.mean != detached.gaussians.mean);
  for (std::size_t k = 0; k < 20 * 5; ++k) CHECK(attached.features[k] == 0);
  // As where there are no features.
  tracer.set_channels({});
  traced.by_features.resize(0);
  auto without = tracer.forward(traced.rays.rays(), sweep_options());
  auto const plain = traced.differentiate(tracer, without, count, 1);
  CHECK(same_bits(plain.gaussians, detached.gaussians));
  CHECK(plain.directions == detached.directions);
}

TEST_CASE_TEMPLATE("depth is a channel over hits as well", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model const model = cloud(seed, 0, 200);
  gart::gaussians<E> const scene(exec, model);
  random_rays const some(seed + 1, 300, 1.0f);
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 0);
  auto const expected = trace_all(exec, tracer, batch.rays(), {});
  auto const table = tracer.list(batch.rays(), {});
  gart::buffer<float, E> depth(exec, 300);
  sum_channel(exec, table.view(), gart::depth_channel{}, depth.data());
  CHECK(depth.to_host() == expected.depth);
}

TEST_CASE_TEMPLATE("features whose counts disagree are refused by name", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model const model = featured_cloud(5, 0, 100, 3);
  featured_scene<E> scene(exec, model);
  sweep const s(6, 50, 3);
  traced_sweep<E> traced(exec, s);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.scene.view(), 0);
  auto const with = [&](index_t count, int width, float const* values) {
    return [&tracer, count, width, values] { tracer.set_channels({{values, count, width}}); };
  };
  float const* const values = scene.features.data();
  refused(with(99, 3, values), "feature_view.count is 99, and there are 100 Gaussians");
  refused(with(100, 513, values), "feature_view.width is 513: a Gaussian has 1 to 512 features");
  refused(with(100, -1, values), "feature_view.width is -1");
  refused(with(100, 3, nullptr), "feature_view.values is null");

  gart::buffer<float, E> shown(exec, 150), few(exec, 7), out(exec, 300);
  gart::batch_targets to;
  to.channels.features = shown.data();
  refused([&] { tracer.trace(traced.rays.rays(), {}, to); }, "the Gaussians have no features");
  refused([&] { tracer.forward(traced.rays.rays(), {}, to); }, "the Gaussians have no features");
  scene.give_to(tracer);
  auto context = tracer.forward(traced.rays.rays(), {});
  gart::output_gradients by;
  by.channels.features = few;
  refused([&] { tracer.backward(context, by, {}); }, "channel_gradients.features has 7 numbers");
  by.channels.features = traced.by_features;
  refused([&] { tracer.backward(context, by, {}, {}, {{out.data(), 99, 3}}); }, "is of 99 Gaussians and 3 features");
  refused([&] { tracer.backward(context, by, {}, {}, {{out.data(), 100, 4}}); }, "is of 100 Gaussians and 4 features");
  tracer.set_channels({});
  auto without = tracer.forward(traced.rays.rays(), {});
  refused([&] { tracer.backward(without, by, {}); }, "the Gaussians have none");

  // No rays, and rays without a hit.
  scene.give_to(tracer);
  batch_memory<E> const none(exec, {}, {}, {}), past(exec, {500, 0, 0}, {}, {1, 0, 0});
  auto empty = tracer.forward(none.rays(), {}, to);
  tracer.backward(empty, {}, {}, {}, {{out.data(), 100, 3}});
  CHECK(out.to_host() == std::vector<float>(300));
  auto missed = tracer.forward(past.rays(), {}, to);
  CHECK(shown.to_host()[2] == 0);
  gart::buffer<float, E> const one(exec, std::vector<float>{1, 2, 3});
  by.channels.features = one;
  gart::gaussians<E> gradients(exec, 100, 0);
  tracer.backward(missed, by, gradients.view(), {}, {{out.data(), 100, 3}});
  CHECK(out.to_host() == std::vector<float>(300));
  CHECK(gradients.to_host().mean == std::vector<float>(300));
}
