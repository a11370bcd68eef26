// Gradients of an arbitrary lidar sweep, to the Gaussians and to the rays, in each form: against central differences of
// a tracer in double.
#include <rays/sweep.hpp>

#include <algorithm>

using namespace gart_test;
using gart::gradient_form;
using gart::index_t;

TEST_CASE_TEMPLATE("gradients of a lidar sweep are its differences", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  for (int const degree : {3, 1}) {
    CAPTURE(degree);
    gart::gaussian_model const model = cloud(seed, degree, 40);
    sweep const s(seed + 1, 60);
    gart::gaussians<E> const scene(exec, model);
    traced_sweep<E> traced(exec, s);
    gart::ray_tracer<E> tracer(exec);
    tracer.set_scene(scene.view(), degree);
    for (gradient_form const form : {gradient_form::scatter, gradient_form::primitive}) {
      CAPTURE(static_cast<int>(form));
      auto context = tracer.forward(traced.rays.rays(), sweep_options(), {}, form);
      compare("a sweep of degree " + std::to_string(degree), model, s, sweep_options(),
              traced.differentiate(tracer, context, scene.size(), degree));
    }
  }
}

TEST_CASE_TEMPLATE("both forms sum the same, one of them the same bits", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  // Gaussians with more hits than two tiles of them, and some with none.
  gart::gaussian_model model = cloud(seed, 2, 700);
  for (std::size_t i = 0; i < 20; ++i) model.mean[3 * i] += 1000;
  for (std::size_t i = 60; i < 180; ++i) model.log_scale[i] += 2;
  sweep const s(seed + 1, 2000);
  gart::gaussians<E> const scene(exec, model);
  traced_sweep<E> traced(exec, s);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 2);
  auto scattered = tracer.forward(traced.rays.rays(), sweep_options(), {}, gradient_form::scatter);
  // The first has no room for its hits and is traced twice, the second has.
  auto first = tracer.forward(traced.rays.rays(), sweep_options(), {}, gradient_form::primitive);
  auto second = tracer.forward(traced.rays.rays(), sweep_options(), {}, gradient_form::primitive);
  std::vector<std::size_t> hits(700);
  for (gart::u32 const id : tracer.list(traced.rays.rays(), sweep_options()).to_host().ids) ++hits[id];
  CHECK(*std::max_element(hits.begin(), hits.end()) > 3 * gart::ray_kernels::hit_tile::size);
  CHECK(std::count(hits.begin(), hits.end(), 0u) >= 20);
  auto const by_scatter = traced.differentiate(tracer, scattered, scene.size(), 2);
  auto const by_primitive = traced.differentiate(tracer, first, scene.size(), 2);
  CHECK(difference(by_primitive.gaussians.mean, by_scatter.gaussians.mean) < 1e-4);
  CHECK(difference(by_primitive.gaussians.log_scale, by_scatter.gaussians.log_scale) < 1e-4);
  CHECK(difference(by_primitive.gaussians.quaternion, by_scatter.gaussians.quaternion) < 1e-4);
  CHECK(difference(by_primitive.gaussians.opacity, by_scatter.gaussians.opacity) < 1e-4);
  CHECK(difference(by_primitive.gaussians.sh, by_scatter.gaussians.sh) < 1e-4);
  CHECK(by_primitive.directions == by_scatter.directions);
  for (auto* const again : {&second, &first})
    CHECK(same_bits(traced.differentiate(tracer, *again, scene.size(), 2).gaussians, by_primitive.gaussians));
}

TEST_CASE_TEMPLATE("what a batch shows does not depend on its gradients", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussians<E> const scene(exec, cloud(5, 1, 300));
  random_rays const some(6, 500, 1.0f);
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 1);
  auto const expected = trace_all(exec, tracer, batch.rays(), {});
  for (gradient_form const form : {gradient_form::scatter, gradient_form::primitive}) {
    target_memory<E> out(exec, 500);
    tracer.forward(batch.rays(), {}, out.targets(), form);
    CHECK(same(out.to_host(), expected));
  }
}

TEST_CASE_TEMPLATE("a context of Gaussians that have changed is refused", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model model = cloud(5, 1, 100);
  gart::gaussians<E> scene(exec, model);
  sweep const s(6, 50);
  traced_sweep<E> traced(exec, s);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 1);
  auto context = tracer.forward(traced.rays.rays(), sweep_options());
  auto const before = traced.differentiate(tracer, context, 100, 1);
  // Another batch, of another frame and cut-off, leaves it as it is; so do the same Gaussians.
  gart::render_options coarse;
  coarse.alpha_min = 0.2f;
  batch_memory<E> const elsewhere(exec, {3, 0, 0}, s.origins, s.directions);
  target_memory<E> out(exec, 50);
  tracer.trace(elsewhere.rays(), coarse, out.targets());
  tracer.set_scene(scene.view(), 1);
  auto const after = traced.differentiate(tracer, context, 100, 1);
  CHECK(same_bits(after.gaussians, before.gaussians));
  CHECK(after.directions == before.directions);

  auto const refused = [&](auto&& call, char const* what) {
    CHECK_THROWS_WITH_AS(call(), doctest::Contains(what), gart::invalid_argument);
  };
  gart::gaussians<E> fewer(exec, 99, 1), lower(exec, 100, 0), right(exec, 100, 1);
  refused([&] { tracer.backward(context, traced.by(), fewer.view()); }, "the number of the Gaussians");
  refused([&] { tracer.backward(context, traced.by(), lower.view()); }, "at least the SH degree");
  gart::buffer<float, E> const shorter(exec, 7);
  refused([&] { tracer.backward(context, {shorter}, right.view()); }, "output_gradients.color has 7 numbers");
  refused([&] { tracer.backward(context, {{}, shorter}, right.view()); }, "output_gradients.depth has 7 numbers");

  model.opacity[17] += 0.1f;
  scene.assign(model);
  tracer.set_scene(scene.view(), 1);
  refused([&] { tracer.backward(context, traced.by(), right.view()); }, "have changed since forward()");
}
