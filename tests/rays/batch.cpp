// What a batch of rays sees: the image's numbers where they are an image's rays, what hit lists say where they are not;
// and what is refused.
#include <rays/view_rays.hpp>
#include <support/refused.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <thread>
#include <utility>

using namespace gart_test;
using gart::index_t;
using gart::u32;

TEST_CASE_TEMPLATE("the rays of a view as a batch see the view", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model const model = cloud(seed, 2, 400);
  gart::gaussians<E> const scene(exec, model);
  gart::ray_tracer<E> tracer(exec);  // one tree for all cameras
  gart::render_options options;
  options.background = gart::vec3(0.1f, 0.5f, 0.9f);
  for (auto const& [name, view] : cameras())
    for (int const degree : {2, 1}) {
      CAPTURE(name);
      CAPTURE(degree);
      auto const by_tree = trace_view<gart::bvh_tracer<E>>(exec, model, view, options, degree);
      auto const by_tiles = trace_view<gart::tile_tracer<E>>(exec, model, view, options, degree);
      REQUIRE(by_tree.color == by_tiles.color);
      batch_memory<E> const batch(exec, view.position, by_tree.origins, by_tree.directions);
      tracer.set_scene(scene.view(), degree);
      auto const got = trace_all(exec, tracer, batch.rays(), options);
      CHECK(got.color == by_tree.color);
      CHECK(got.transmittance == by_tree.transmittance);
      CHECK(got.depth == by_tree.depth);
      CHECK(got.hits == by_tree.hits);
      CHECK(*std::max_element(got.hits.begin(), got.hits.end()) > 16);
    }
}

TEST_CASE_TEMPLATE("hit lists are complete and say what rays see", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model const model = cloud(seed, 0, 600);
  gart::gaussians<E> const scene(exec, model);
  random_rays const some(seed + 1, 300, 1.5f);
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 0);
  gart::render_options options;
  gart::render_options everything = options;
  everything.transmittance_min = 0;
  gart::hit_lists const all = tracer.list(batch.rays(), everything).to_host();
  gart::hit_lists const lists = tracer.list(batch.rays(), options).to_host();

  // All that any ray meets, one by one.
  std::vector<gart::ray_gaussian> prepared;
  for (std::size_t i = 0; i < model.size(); ++i) {
    gart::gaussian_parameters const p{{model.mean[3 * i], model.mean[3 * i + 1], model.mean[3 * i + 2]},
                                      {model.log_scale[3 * i], model.log_scale[3 * i + 1], model.log_scale[3 * i + 2]},
                                      {model.quaternion[4 * i], model.quaternion[4 * i + 1],
                                       model.quaternion[4 * i + 2], model.quaternion[4 * i + 3]},
                                      model.opacity[i]};
    prepared.push_back(gart::prepare(p, {}, options.alpha_min));
  }
  REQUIRE(all.offsets.size() == 301);
  REQUIRE(all.offsets.back() == all.ids.size());
  auto const seen = trace_all(exec, tracer, batch.rays(), options);
  std::size_t longest = 0;
  for (std::size_t r = 0; r < 300; ++r) {
    CAPTURE(r);
    gart::ray const ray{{some.origins[3 * r], some.origins[3 * r + 1], some.origins[3 * r + 2]},
                        {some.directions[3 * r], some.directions[3 * r + 1], some.directions[3 * r + 2]}};
    std::vector<std::pair<float, u32>> expected;
    for (u32 i = 0; i < prepared.size(); ++i)
      if (auto const peak = gart::evaluate(prepared[i], ray); gart::is_hit(prepared[i], peak, options.near))
        expected.emplace_back(peak.t, i);
    std::sort(expected.begin(), expected.end());
    std::size_t const from = all.offsets[r], count = all.offsets[r + 1] - from;
    REQUIRE(count == expected.size());
    longest = std::max(longest, count);
    for (std::size_t k = 0; k < count; ++k) {
      REQUIRE(all.ids[from + k] == expected[k].second);
      REQUIRE(all.t[from + k] == expected[k].first);
    }

    // The lists that end where rays do, and what follows from them.
    std::size_t const begin = lists.offsets[r], end = lists.offsets[r + 1];
    REQUIRE(end - begin <= count);
    REQUIRE(seen.hits[r] == end - begin);
    float transmittance = 1, depth = 0, median = gart::no_hit, top = 0;
    u32 median_id = gart::no_gaussian, top_id = gart::no_gaussian;
    for (std::size_t k = begin; k < end; ++k) {
      REQUIRE(lists.ids[k] == all.ids[from + k - begin]);
      CHECK(lists.weight[k] == doctest::Approx(transmittance * lists.alpha[k]).epsilon(1e-6));
      depth += lists.weight[k] * lists.t[k];
      transmittance *= 1 - lists.alpha[k];
      if (median_id == gart::no_gaussian && transmittance < 0.5f) median = lists.t[k], median_id = lists.ids[k];
      if (lists.weight[k] > top) top = lists.weight[k], top_id = lists.ids[k];
    }
    CHECK(seen.transmittance[r] == doctest::Approx(transmittance).epsilon(1e-5));
    CHECK(seen.depth[r] == doctest::Approx(depth).epsilon(1e-5));
    CHECK(seen.median[r] == median);
    CHECK(seen.median_id[r] == median_id);
    CHECK(seen.top_id[r] == top_id);
    CHECK(seen.first[r] == (begin == end ? gart::no_hit : lists.t[begin]));
    CHECK(seen.first_id[r] == (begin == end ? gart::no_gaussian : lists.ids[begin]));
  }
  CHECK(longest > 16);
}

TEST_CASE_TEMPLATE("a ray that ends meets what lies before its end", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussians<E> const scene(exec, cloud(seed, 1, 500));
  random_rays const some(seed + 1, 200, 1.5f);
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 1);
  batch_memory<E> const whole(exec, {}, some.origins, some.directions);
  gart::hit_lists const all = tracer.list(whole.rays(), {}).to_host();
  // An end at a hit, one between two hits, one before all, one beyond all.
  std::vector<float> ends;
  for (std::size_t r = 0; r < 200; ++r) {
    std::size_t const begin = all.offsets[r], count = all.offsets[r + 1] - begin;
    float const at = count ? all.t[begin + count / 2] : 1.0f;
    ends.push_back(r % 4 == 0 ? at : r % 4 == 1 ? at * 1.001f : r % 4 == 2 ? 0.0101f : HUGE_VALF);
  }
  batch_memory<E> const cut(exec, {}, some.origins, some.directions, ends);
  gart::hit_lists const lists = tracer.list(cut.rays(), {}).to_host();
  auto const seen = trace_all(exec, tracer, cut.rays(), {});
  for (std::size_t r = 0; r < 200; ++r) {
    CAPTURE(r);
    std::size_t k = all.offsets[r];
    while (k < all.offsets[r + 1] && all.t[k] <= ends[r]) ++k;
    REQUIRE(lists.offsets[r + 1] - lists.offsets[r] == k - all.offsets[r]);
    REQUIRE(seen.hits[r] == k - all.offsets[r]);
    for (std::size_t j = all.offsets[r], i = lists.offsets[r]; j < k; ++j, ++i) REQUIRE(lists.ids[i] == all.ids[j]);
  }
}

TEST_CASE_TEMPLATE("one tree serves rays of any frame with the same bits", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model model = cloud(seed, 1, 500);
  for (std::size_t i = 0; i < model.size(); ++i) model.mean[3 * i] += 30;
  gart::gaussians<E> scene(exec, model);
  random_rays const some(seed + 1, 250, 1.0f);
  gart::ray_tracer<E> kept(exec);
  kept.set_scene(scene.view(), 1);
  for (double const x : {30.0, 31.0, 0.0, -2000.0}) {
    CAPTURE(x);
    std::vector<float> origins = some.origins;
    for (std::size_t r = 0; r < 250; ++r) origins[3 * r] += static_cast<float>(30 - x);
    batch_memory<E> const batch(exec, {x, 0, 0}, origins, some.directions);
    gart::ray_tracer<E> fresh(exec);
    fresh.set_scene(scene.view(), 1);
    auto const expected = trace_all(exec, fresh, batch.rays(), {});
    CHECK(same(trace_all(exec, kept, batch.rays(), {}), expected));
    CHECK(kept.index().frame().x == 30);
    CHECK(*std::max_element(expected.hits.begin(), expected.hits.end()) > 5);
  }

  // What is written to the arrays counts from the next set_scene on: by a refit, and by a new tree.
  batch_memory<E> const batch(exec, {30, 0, 0}, some.origins, some.directions);
  for (int const rebuild_every : {1, 5}) {
    gart::render_options options;
    options.rebuild_every = rebuild_every;
    for (auto& m : model.mean) m *= 1.01f;
    for (auto& s : model.log_scale) s += 0.05f;
    scene.assign(model);
    kept.set_scene(scene.view(), 1);
    gart::ray_tracer<E> fresh(exec);
    fresh.set_scene(scene.view(), 1);
    CHECK(same(trace_all(exec, kept, batch.rays(), options), trace_all(exec, fresh, batch.rays(), options)));
  }
}

TEST_CASE_TEMPLATE("tracers of several threads share one tree", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model model = cloud(seed, 1, 500);
  gart::gaussians<E> scene(exec, model);
  gart::render_options options;
  gart::shared_index<E> const tree(exec, scene.view(), options.alpha_min, {0.5, 0, 0});
  constexpr std::size_t threads = 3;
  std::vector<gart::traced_rays> got(threads), expected(threads);
  std::vector<gart::gaussian_model> gradients(threads), wanted(threads);
  std::vector<char> shares(threads, 0);
  auto const run = [&](std::size_t k, gart::shared_index<E> const* by, gart::traced_rays& out,
                       gart::gaussian_model& back) {
    E own;
    gart::ray_tracer<E> tracer(own);
    tracer.share(by);
    tracer.set_scene(std::as_const(scene).view(), 1);
    random_rays const some(seed + 1 + k, 150, 1.0f);
    batch_memory<E> const batch(own, {static_cast<double>(k), 0, 0}, some.origins, some.directions);
    gart::buffer<float, E> const by_color(own, some.origins);
    gart::gaussians<E> by_gaussians(own, scene.size(), 1);
    for (int again = 0; again < 3; ++again) {
      out = trace_all(own, tracer, batch.rays(), options);
      auto context = tracer.forward(batch.rays(), options);
      tracer.backward(context, {by_color}, by_gaussians.view());
    }
    back = by_gaussians.to_host();
    shares[k] = by && &tracer.index() == &by->index();
  };
  std::vector<std::thread> all;
  for (std::size_t k = 0; k < threads; ++k) all.emplace_back([&, k] { run(k, &tree, got[k], gradients[k]); });
  for (auto& t : all) t.join();
  for (std::size_t k = 0; k < threads; ++k) {
    CHECK(shares[k]);
    run(k, nullptr, expected[k], wanted[k]);
    CHECK(same(got[k], expected[k]));
    CHECK(gradients[k].mean == wanted[k].mean);
    CHECK(gradients[k].sh == wanted[k].sh);
    CHECK(*std::max_element(got[k].hits.begin(), got[k].hits.end()) > 5);
  }

  // One that no longer fits is not looked at.
  for (auto& m : model.mean) m += 0.5f;
  scene.assign(model);
  run(0, &tree, got[0], gradients[0]), run(0, nullptr, expected[0], wanted[0]);
  CHECK(same(got[0], expected[0]));
  options.alpha_min = 0.1f;
  run(0, &tree, got[0], gradients[0]);
  CHECK(!shares[0]);
}

TEST_CASE_TEMPLATE("rays that meet nothing see the background", E, GART_TEST_POLICIES) {
  E exec;
  gart::render_options options;
  options.background = gart::vec3(0.25f, 0.5f, 0.75f);
  batch_memory<E> const batch(exec, {}, {}, {0, 0, 1, 0, 1, 0});
  gart::gaussian_model behind = cloud(3, 1, 1);
  behind.mean = {-5, -50, -50};
  for (gart::gaussian_model const& model : {gart::with_sh_degree({}, 1), behind}) {
    CAPTURE(model.size());
    gart::gaussians<E> const scene(exec, model);
    gart::ray_tracer<E> tracer(exec);
    tracer.set_scene(scene.view(), 1);
    auto const seen = trace_all(exec, tracer, batch.rays(), options);
    CHECK(seen.color == std::vector<float>{0.25f, 0.5f, 0.75f, 0.25f, 0.5f, 0.75f});
    CHECK(seen.transmittance == std::vector<float>{1, 1});
    CHECK(seen.first == std::vector<float>{gart::no_hit, gart::no_hit});
    CHECK(seen.median_id == std::vector<u32>{gart::no_gaussian, gart::no_gaussian});
    gart::hit_lists const lists = tracer.list(batch.rays(), options).to_host();
    CHECK(lists.offsets == std::vector<gart::u64>{0, 0, 0});
    CHECK(lists.ids.empty());
    gart::gaussians<E> gradients(exec, scene.size(), 1);
    gart::buffer<float, E> const by(exec, std::vector<float>(6, 1.0f));
    gart::buffer<float, E> directions(exec, 6);
    for (auto const form : {gart::gradient_form::scatter, gart::gradient_form::primitive}) {
      auto context = tracer.forward(batch.rays(), options, {}, form);
      tracer.backward(context, {by}, gradients.view(), {nullptr, directions.data()});
      for (float const g : gradients.to_host().mean) CHECK(g == 0);
      for (float const g : gradients.to_host().sh) CHECK(g == 0);
      for (float const g : directions.to_host()) CHECK(g == 0);
    }
  }
}

TEST_CASE_TEMPLATE("directions of any length are one ray", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussians<E> const scene(exec, cloud(3, 0, 200));
  random_rays const some(4, 100, 1.0f);
  std::vector<float> longer = some.directions;
  for (auto& d : longer) d *= 37;
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 0);
  batch_memory<E> const unit(exec, {}, some.origins, some.directions), any(exec, {}, some.origins, longer);
  auto const a = trace_all(exec, tracer, unit.rays(), {}), b = trace_all(exec, tracer, any.rays(), {});
  for (std::size_t r = 0; r < 100; ++r) CHECK(a.depth[r] == doctest::Approx(b.depth[r]).epsilon(1e-3));
}

TEST_CASE_TEMPLATE("rays that are none are refused by number", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussians<E> const scene(exec, cloud(3, 0, 20));
  gart::ray_tracer<E> tracer(exec);
  float const nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  std::vector<float> const o(12, 0.0f), d{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0.6f, 0.8f}, end(4, 5.0f);
  auto const trace = [&](std::vector<float> const& origins, std::vector<float> const& directions,
                         std::vector<float> const& t_max, gart::render_options const& options = {}) {
    batch_memory<E> const batch(exec, {}, origins, directions, t_max);
    trace_all(exec, tracer, batch.rays(), options);
  };
  auto const with = [](std::vector<float> v, std::size_t at, float x) { return v[at] = x, v; };
  refused([&] { trace(o, d, end); }, "ray_tracer.set_scene first");
  tracer.set_scene(scene.view(), 0);
  CHECK_NOTHROW(trace(o, d, end));
  CHECK_NOTHROW(trace({}, d, {}));
  CHECK_NOTHROW(trace({}, {}, {}));
  refused([&] { trace(with(o, 7, nan), d, end); }, "ray_batch.origins[2] is");
  refused([&] { trace(o, with(d, 4, inf), end); }, "ray_batch.directions[1] is");
  refused([&] { trace(o, with(d, 8, 0), end); },
          "ray_batch.directions[2] is (0.000000, 0.000000, 0.000000), which has");
  refused([&] { trace(o, d, with(end, 3, nan)); }, "ray_batch.t_max[3] is");
  refused([&] { trace(o, d, with(end, 3, 0.01f)); }, "before render_options.near");
  refused([&] { trace({0, 0, 0}, d, end); }, "ray_batch.origins has 3 numbers");
  refused([&] { trace(o, d, {1, 2}); }, "ray_batch.t_max has 2 numbers");
  refused([&] { trace(o, {1, 0, 0, 1}, {}); }, "ray_batch.directions has 4 numbers");
  gart::render_options filtered;
  filtered.antialias = 0.3f;
  refused([&] { trace(o, d, end, filtered); }, "render_options.antialias");
}
