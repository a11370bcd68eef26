// Scenes of instances: what rays and views see of them, and the gradients of models and poses, against each model
// traced apart, a camera that moves in place of the model, and central differences in double.
#include <gart/instances/instance_set.hpp>

#include <rays/double_scene.hpp>
#include <rays/placed_models.hpp>
#include <rays/sweep.hpp>
#include <support/refused.hpp>

#include <algorithm>
#include <array>
#include <limits>

using namespace gart_test;
using gart::index_t;
using gart::instance;
using gart::mat3d;
using gart::u32;
using gart::vec3d;

namespace {

mat3d rotation(vec3d const& by) { return gart::turn_of(by); }

// Two models, of unlike degrees, one of them twice and the other scaled.
struct actors {
  std::vector<gart::gaussian_model> models;
  std::vector<instance> instances{{0, rotation({0.3, -0.2, 1.1}), {0.4, 0.1, -0.3}},
                                  {1, rotation({-1.9, 0.5, 0.2}), {-0.8, 0.7, 0.5}},
                                  {0, rotation({2.0, 1.5, -0.4}), {-0.5, -1.1, 0.3}},
                                  {1, rotation({0.1, 0.2, 0.9}), {0.9, 0.6, 0.2}, 1.4}};

  actors(std::uint64_t seed, std::size_t count) : models{cloud(seed, 3, count), cloud(seed + 1, 1, count - count / 4)} {
    for (auto& m : models)
      for (auto& x : m.mean) x *= 0.6f;
  }
};

template <class E>
struct placed_actors {
  placed_models<E> models;
  gart::instance_set<E> set;
  placed_actors(E& exec, actors const& a, int degree = 3) : models(exec, a.models), set(exec, degree) {
    set.set(models.views(), a.instances);
  }
};

}  // namespace

TEST_CASE_TEMPLATE("hits of a scene are those of its instances, in order", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  actors const a(seed, 150);
  placed_actors<E> placed(exec, a);
  random_rays const some(seed + 2, 300, 1.5f);
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);
  gart::render_options everything;
  everything.transmittance_min = 0, everything.near = 1e-4f;
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(placed.set.scene(), 3);
  gart::hit_lists const all = tracer.list(batch.rays(), everything).to_host();

  struct expected_hit {
    float t;
    u32 instance, gaussian;
    bool operator<(expected_hit const& other) const { return t < other.t; }
  };
  std::vector<std::vector<expected_hit>> expected(300);
  for (u32 n = 0; n < a.instances.size(); ++n) {
    instance const& one = a.instances[n];
    std::vector<float> origins, directions;
    for (std::size_t r = 0; r < 300; ++r) {
      vec3d const o(some.origins[3 * r], some.origins[3 * r + 1], some.origins[3 * r + 2]);
      vec3d const d(some.directions[3 * r], some.directions[3 * r + 1], some.directions[3 * r + 2]);
      vec3d const own = (o - one.position) * one.rotation / one.scale, way = d * one.rotation;
      for (int k = 0; k < 3; ++k)
        origins.push_back(static_cast<float>(own[k])), directions.push_back(static_cast<float>(way[k]));
    }
    batch_memory<E> const turned(exec, {}, origins, directions);
    gart::render_options near = everything;
    near.near /= static_cast<float>(one.scale);
    gart::ray_tracer<E> apart(exec);
    gart::gaussians<E> const model(exec, a.models[one.model]);
    apart.set_scene(model.view(), a.models[one.model].sh_degree);
    gart::hit_lists const lists = apart.list(turned.rays(), near).to_host();
    for (std::size_t r = 0; r < 300; ++r)
      for (std::size_t k = lists.offsets[r]; k < lists.offsets[r + 1]; ++k)
        expected[r].push_back({lists.t[k] * static_cast<float>(one.scale), n, lists.ids[k]});
  }
  std::size_t compared = 0, hits = 0;
  for (std::size_t r = 0; r < 300; ++r) {
    CAPTURE(r);
    // Hits of the same distance but for roundings may change places, and one of alpha_min may be none.
    std::size_t const begin = all.offsets[r], count = all.offsets[r + 1] - begin;
    std::sort(expected[r].begin(), expected[r].end());
    bool clear = count == expected[r].size();
    for (std::size_t k = 1; k < expected[r].size(); ++k)
      clear = clear && expected[r][k].t > expected[r][k - 1].t * 1.0001f;
    if (!clear) continue;
    ++compared, hits += count;
    for (std::size_t k = 0; k < count; ++k) {
      gart::instance_gaussian const whose = placed.set.of(all.ids[begin + k]);
      REQUIRE(whose.instance == expected[r][k].instance);
      REQUIRE(whose.gaussian == expected[r][k].gaussian);
      CHECK(all.t[begin + k] == doctest::Approx(expected[r][k].t).epsilon(1e-3));
    }
  }
  CHECK(compared > 200);
  CHECK(hits > 10 * compared);
}

TEST_CASE_TEMPLATE("gradients of instances are differences of models and poses", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  actors const a(seed, 16);
  placed_actors<E> placed(exec, a);
  sweep const s(seed + 2, 60);
  traced_sweep<E> traced(exec, s);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(placed.set.scene(), 3);
  auto context = tracer.forward(traced.rays.rays(), sweep_options());
  gart::gaussians<E> by_scene(exec, placed.set.scene().count, 3);
  tracer.backward(context, traced.by(), by_scene.view());
  // A third model stands nowhere, and the second's gradients are wanted to the degree that it has.
  std::vector<gart::gaussians<E>> by_models;
  for (auto const& m : a.models) by_models.emplace_back(exec, m.size(), m.sh_degree);
  gart::buffer<float, E> by_poses(exec, 6 * a.instances.size());
  std::vector<gart::gaussians_view<float>> const targets{by_models[0].view(), by_models[1].view()};
  gart::instance_gradients to;
  to.models = targets, to.poses = by_poses.data();
  placed.set.backward(std::as_const(by_scene).view(), to);

  std::vector<double_model> models{double_model(a.models[0]), double_model(a.models[1])};
  std::vector<std::array<double, 6>> moved(a.instances.size(), std::array<double, 6>{});
  auto const loss = [&] {
    double_model const scene = scene_of(models, a.instances, moved);
    return see_all(s, [&](std::size_t i) { return see(scene, s.ray(i), s.weights(i), sweep_options()); });
  };
  // What is differentiated is what was shown.
  target_memory<E> out(exec, s.count());
  tracer.trace(traced.rays.rays(), sweep_options(), out.targets());
  gart::traced_rays const shown = out.to_host();
  double total = 0;
  for (std::size_t i = 0; i < s.count(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) total += double{s.by_color[3 * i + c]} * double{shown.color[3 * i + c]};
    total += double{s.by_depth[i]} * double{shown.depth[i]};
    total += double{s.by_transmittance[i]} * double{shown.transmittance[i]};
  }
  CHECK(total == doctest::Approx(loss().loss).epsilon(1e-3));

  kept_slopes kept("instances");
  std::size_t used = 0, tried = 0;
  auto const check = [&](std::vector<double>& values, std::vector<float> const& by, char const* what) {
    CAPTURE(what);
    comparison c;
    std::size_t const step = values.size() > 30 ? values.size() / 30 : 1;
    for (std::size_t i = 0; i < values.size(); i += step) {
      ++tried;
      auto const expected = slope(kept, values[i], loss);
      if (!expected) continue;
      ++used;
      c.add(double{by[i]}, *expected);
    }
    CHECK(c.relative() < 2e-4);
  };
  for (std::size_t m = 0; m < 2; ++m) {
    CAPTURE(m);
    gart::gaussian_model const got = by_models[m].to_host();
    check(models[m].mean, got.mean, "mean");
    check(models[m].log_scale, got.log_scale, "log-scale");
    check(models[m].quaternion, got.quaternion, "quaternion");
    check(models[m].opacity, got.opacity, "opacity");
    check(models[m].sh, got.sh, "SH");
  }
  comparison positions, turns;
  std::vector<float> const poses = by_poses.to_host();
  for (std::size_t n = 0; n < moved.size(); ++n)
    for (std::size_t k = 0; k < 6; ++k) {
      ++tried;
      auto const expected = slope(kept, moved[n][k], loss);
      if (!expected) continue;
      ++used;
      (k < 3 ? positions : turns).add(double{poses[6 * n + k]}, *expected);
    }
  CHECK(positions.relative() < 2e-4);
  CHECK(turns.relative() < 2e-4);
  CHECK(used > tried / 2);
}

TEST_CASE_TEMPLATE("a view of an instance is its model's from a moved camera", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model const model = cloud(seed, 3, 120);
  gart::gaussians<E> const there(exec, model);
  instance const one{0, rotation({0.7, -1.2, 0.4}), {3, -2, 1}};
  gart::instance_set<E> set(exec, 3);
  set.set({there.view()}, {one});
  gart::gaussian_model moved;
  {
    gart::gaussians<E> copy(exec, set.scene().count, 3);
    gart::for_each_array([&](gart::parameter_array const& a, float const* from,
                             auto& to) { exec.copy(to.data(), from, sizeof(float) * a.width(3) * model.size()); },
                         set.scene(), copy);
    moved = copy.to_host();
  }
  gart::camera const view = cameras()[0].second;
  gart::camera seen = view;
  seen.position = one.rotation * view.position + one.position;
  seen.rotation = gart::mat3(one.rotation * mat3d(view.rotation));
  auto const expected = trace_view<gart::tile_tracer<E>>(exec, model, view, {}, 3);
  auto const by_tiles = trace_view<gart::tile_tracer<E>>(exec, moved, seen, {}, 3);
  auto const by_tree = trace_view<gart::bvh_tracer<E>>(exec, moved, seen, {}, 3);
  CHECK(by_tiles.color == by_tree.color);
  std::size_t compared = 0;
  for (std::size_t p = 0; p < expected.hits.size(); ++p) {
    if (expected.hits[p] != by_tiles.hits[p]) continue;
    ++compared;
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(by_tiles.color[3 * p + c] == doctest::Approx(expected.color[3 * p + c]).epsilon(1e-3));
  }
  CHECK(compared > expected.hits.size() * 9 / 10);
}

TEST_CASE_TEMPLATE("instances move, and those at rest keep their bits", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  actors a(seed, 80);
  a.instances[0].rotation = mat3d(1.0), a.instances[0].position = vec3d(0.0);
  placed_actors<E> placed(exec, a);
  gart::ray_tracer<E> tracer(exec);
  random_rays const some(seed + 2, 200, 1.5f);
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);
  tracer.set_scene(placed.set.scene(), 3);
  auto const before = trace_all(exec, tracer, batch.rays(), {});

  // At the origin an instance is its model, bit for bit.
  gart::instance_set<E> alone(exec, 3);
  alone.set({placed.models.memory[0].view()}, {{}});
  gart::ray_tracer<E> of_model(exec), of_instance(exec);
  of_model.set_scene(placed.models.memory[0].view(), 3), of_instance.set_scene(alone.scene(), 3);
  CHECK(same(trace_all(exec, of_instance, batch.rays(), {}), trace_all(exec, of_model, batch.rays(), {})));

  // There and back, by refits of the tree and by new ones; and what a new set makes of the same poses.
  std::vector<instance> elsewhere = a.instances;
  elsewhere[1].position.x += 0.5, elsewhere[3].rotation = rotation({0.1, 2.0, 0.2});
  gart::render_options refits;
  refits.rebuild_every = 5;
  placed.set.move(elsewhere);
  tracer.set_scene(placed.set.scene(), 3);
  auto const after = trace_all(exec, tracer, batch.rays(), refits);
  CHECK(!same(after, before));
  actors other(seed, 80);
  other.instances = elsewhere;
  placed_actors<E> fresh(exec, other);
  gart::ray_tracer<E> again(exec);
  again.set_scene(fresh.set.scene(), 3);
  CHECK(same(trace_all(exec, again, batch.rays(), {}), after));
  placed.set.move(a.instances);
  tracer.set_scene(placed.set.scene(), 3);
  CHECK(same(trace_all(exec, tracer, batch.rays(), refits), before));

  // What is written to a model counts from place_all on.
  for (auto& x : a.models[1].opacity) x -= 0.5f;
  placed.models.memory[1].assign(a.models[1]);
  placed.set.place_all();
  tracer.set_scene(placed.set.scene(), 3);
  CHECK(!same(trace_all(exec, tracer, batch.rays(), {}), before));
}

TEST_CASE_TEMPLATE("features of instances are shown and have gradients", E, GART_TEST_POLICIES) {
  E exec;
  actors a(3, 20);
  a.models.push_back(cloud(9, 0, 5));  // stands nowhere
  placed_actors<E> placed(exec, a);
  std::vector<gart::buffer<float, E>> values, by_values;
  std::vector<gart::feature_view<float const>> given;
  std::vector<gart::feature_view<float>> wanted;
  for (auto const& m : a.models) {
    std::vector<float> numbers(2 * m.size());
    for (std::size_t k = 0; k < numbers.size(); ++k) numbers[k] = static_cast<float>(k + 100 * values.size());
    values.emplace_back(exec, numbers), by_values.emplace_back(exec, numbers);
  }
  for (std::size_t m = 0; m < a.models.size(); ++m) {
    index_t const count = static_cast<index_t>(a.models[m].size());
    given.push_back({values[m].data(), count, 2}), wanted.push_back({by_values[m].data(), count, 2});
  }
  placed.set.set(placed.models.views(), a.instances, given);
  gart::feature_view<float const> const features = placed.set.features();
  REQUIRE(features.count == 2 * 20 + 2 * 15);
  std::vector<float> shown(features.size());
  exec.copy_out(shown.data(), features.values, sizeof(float) * shown.size());
  for (u32 id = 0; id < features.count; ++id) {
    auto const whose = placed.set.of(id);
    float const first = static_cast<float>(2 * whose.gaussian + 100 * a.instances[whose.instance].model);
    CHECK(shown[2 * id] == first);
    CHECK(shown[2 * id + 1] == first + 1);
  }
  gart::gaussians<E> by_scene(exec, features.count, 3);
  by_scene.zero();
  gart::instance_gradients to;
  to.features = wanted;
  placed.set.backward(std::as_const(by_scene).view(), to, features);
  std::vector<float> const sums[3] = {by_values[0].to_host(), by_values[1].to_host(), by_values[2].to_host()};
  for (std::size_t m = 0; m < 3; ++m)
    for (std::size_t k = 0; k < sums[m].size(); ++k)
      CHECK(sums[m][k] == (m < 2 ? 2.0f * static_cast<float>(k + 100 * m) : 0.0f));
}

TEST_CASE_TEMPLATE("instances that are none are refused by number", E, GART_TEST_POLICIES) {
  E exec;
  actors const a(3, 8);
  placed_actors<E> placed(exec, a);
  double const nan = std::numeric_limits<double>::quiet_NaN();
  auto const set = [&](auto&& change) {
    std::vector<instance> list = a.instances;
    change(list);
    placed.set.set(placed.models.views(), list);
  };
  refused([&] { placed.set.set(placed.models.views(), {}); }, "instances: there are none");
  refused([&] { set([](auto& list) { list[2].model = 2; }); }, "instances[2].model is 2, and there are 2 models");
  refused([&] { set([&](auto& list) { list[1].position.y = nan; }); }, "instances[1].position is not finite");
  refused([&] { set([&](auto& list) { list[3].rotation[0].y = nan; }); }, "instances[3].rotation is none");
  refused([&] { set([](auto& list) { list[0].rotation *= 1.1; }); }, "instances[0].rotation is none");
  refused([&] { set([](auto& list) { list[0].rotation[2] *= -1.0; }); }, "instances[0].rotation is none");
  refused([&] { set([](auto& list) { list[1].scale = 0; }); }, "instances[1].scale must be");
  refused([&] { placed.set.move({{}}); }, "there are 1 instances, and 4 were set");
  refused(
      [&] {
        std::vector<instance> list = a.instances;
        list[1].model = 0;
        placed.set.move(list);
      },
      "instances[1] is of another model");
  refused([&] { gart::instance_set<E>(exec, 2).set(placed.models.views(), a.instances); },
          "models[0] is of SH degree 3");
  refused([&] { gart::instance_set<E>(exec, 4); }, "SH degree is 4");
  refused([&] { placed.set.set(placed.models.views(), a.instances, {{nullptr, 8, 3}}); }, "features of 1 models");
  gart::gaussians<E> scene(exec, placed.set.scene().count, 3), fewer(exec, 3, 3);
  refused([&] { placed.set.backward(std::as_const(fewer).view(), {}); }, "number and the SH degree of the scene's");
  std::vector<gart::gaussians_view<float>> const one{fewer.view()}, two{fewer.view(), fewer.view()};
  gart::instance_gradients to;
  to.models = one;
  refused([&] { placed.set.backward(std::as_const(scene).view(), to); }, "models has 1 models, and there are 2");
  to.models = two;
  refused([&] { placed.set.backward(std::as_const(scene).view(), to); }, "models[0] must have the number");
}
