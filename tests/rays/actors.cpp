// Rays that see each actor as it stands at their own time: against one scene of all Gaussians, and what tracks are by
// definition: a scene for each ray, in double.
#include <gart/actors/actor_tracer.hpp>
#include <gart/instances/instance_set.hpp>
#include <gart/rays/lidar.hpp>

#include <rays/double_scene.hpp>
#include <rays/placed_models.hpp>
#include <rays/sweep.hpp>
#include <support/refused.hpp>

#include <array>
#include <limits>

using namespace gart_test;
using gart::instance;
using gart::instance_track;
using gart::u32;
using gart::vec3d;

namespace {

using quaternion4 = std::array<double, 4>;

gart::mat3d matrix_of(quaternion4 const& q) {
  double const w = q[0], x = q[1], y = q[2], z = q[3];
  gart::mat3d r;
  r[0] = vec3d(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y));
  r[1] = vec3d(2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x));
  r[2] = vec3d(2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
  return r;
}
// Of a turn about an axis of unit length.
quaternion4 turned(vec3d axis, double angle) {
  axis /= std::sqrt(axis.x * axis.x + axis.y * axis.y + axis.z * axis.z);
  double const s = std::sin(angle / 2);
  return {std::cos(angle / 2), s * axis.x, s * axis.y, s * axis.z};
}
quaternion4 product(quaternion4 const& a, quaternion4 const& b) {
  return {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
          a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
}

// A track in double, whose keys have numbers to move them by.
struct double_track {
  u32 model;
  double scale;
  std::vector<double> times;
  std::vector<quaternion4> turns;
  std::vector<vec3d> positions;

  instance_track track() const {
    instance_track out;
    out.times = times;
    for (std::size_t k = 0; k < times.size(); ++k)
      out.poses.push_back({model, matrix_of(turns[k]), positions[k], scale});
    return out;
  }
  // Where it stands; moved: [keys][6].
  instance at(double time, double const* moved) const {
    auto const key = [&](std::size_t k) {
      double const* const by = moved + 6 * k;
      double const angle = std::sqrt(by[3] * by[3] + by[4] * by[4] + by[5] * by[5]);
      return angle > 0 ? product(turned({by[3], by[4], by[5]}, angle), turns[k]) : turns[k];
    };
    auto const place = [&](std::size_t k) {
      return positions[k] + vec3d(moved[6 * k], moved[6 * k + 1], moved[6 * k + 2]);
    };
    if (times.size() == 1) return {model, matrix_of(key(0)), place(0), scale};
    std::size_t k = 0;
    while (k + 2 < times.size() && times[k + 1] <= time) ++k;
    double const f = (time - times[k]) / (times[k + 1] - times[k]);
    // The shorter way on the sphere of quaternions.
    quaternion4 const a = key(k);
    quaternion4 b = key(k + 1), q;
    double cosine = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    if (cosine < 0) {
      cosine = -cosine;
      for (double& x : b) x = -x;
    }
    double const angle = std::acos(std::min(cosine, 1.0));
    for (std::size_t i = 0; i < 4; ++i)
      q[i] = angle > 1e-7 ? (std::sin((1 - f) * angle) * a[i] + std::sin(f * angle) * b[i]) / std::sin(angle)
                          : (1 - f) * a[i] + f * b[i];
    double const norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (double& x : q) x /= norm;
    return {model, matrix_of(q), place(k) * (1 - f) + place(k + 1) * f, scale};
  }
};

// A street that stands, and two cars that drive and turn, one of them the street's model scaled.
struct moving_scene {
  std::vector<gart::gaussian_model> models;
  std::vector<double_track> tracks;

  moving_scene(std::uint64_t seed, std::size_t count) : models{cloud(seed, 3, count), cloud(seed + 1, 1, count)} {
    for (std::size_t i = 0; i < count; ++i) models[1].mean[3 * i] *= 0.7f, models[1].mean[3 * i + 2] *= 0.3f;
    quaternion4 const start = turned({0.1, -0.2, 1}, 0.4);
    tracks = {
        {0, 1, {0}, {turned({1, 2, 0.5}, 0.7)}, {{0.3, -0.2, 0.1}}},
        {1,
         1,
         {-0.1, 0.4, 1.3},
         {start, product(turned({0, 0.3, 1}, 0.9), start), product(turned({0.2, 0.1, 1}, -0.6), start)},
         {{-1.2, 0.6, 0.1}, {0.2, 0.7, 0.2}, {1.4, -0.3, 0.1}}},
        {0, 1.4, {0, 1}, {turned({1, 0, 0}, -0.5), turned({0, 1, 0.2}, 0.4)}, {{0.8, 0.4, 0.2}, {0.5, -0.9, 0.3}}}};
  }
  std::vector<instance_track> actors() const {
    std::vector<instance_track> out;
    for (double_track const& t : tracks) out.push_back(t.track());
    return out;
  }
  std::size_t keys() const { return 6; }
};

template <class E>
gart::traced_rays trace_all(E& exec, gart::actor_tracer<E>& tracer, gart::ray_batch const& rays,
                            gart::render_options const& options) {
  target_memory<E> out(exec, rays.count());
  tracer.trace(rays, options, out.targets());
  return out.to_host();
}

double dot(ray_weights const& by, gart::traced_rays const& seen, std::size_t i) {
  double sum = by.depth * double{seen.depth[i]} + by.transmittance * double{seen.transmittance[i]};
  for (std::size_t c = 0; c < 3; ++c) sum += by.color[c] * double{seen.color[3 * i + c]};
  return sum;
}

}  // namespace

TEST_CASE_TEMPLATE("actors at rest are one scene", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  std::vector<gart::gaussian_model> const models{cloud(seed, 2, 150), cloud(seed + 1, 2, 90)};
  placed_models<E> const there(exec, models);
  random_rays const some(seed + 2, 300, 1.5f);
  std::vector<float> ends(300, 3.0f);
  batch_memory<E> const batch(exec, {0.5, 0.2, -0.1}, some.origins, some.directions, ends);
  gart::render_options options;
  options.background = gart::vec3(0.2f);
  auto const compare = [&](std::vector<instance> const& poses, bool bits) {
    gart::instance_set<E> set(exec, 2);
    set.set(there.views(), poses);
    gart::ray_tracer<E> one(exec);
    one.set_scene(set.scene(), 2);
    gart::actor_tracer<E> tracer(exec);
    std::vector<instance_track> tracks;
    for (instance const& pose : poses) tracks.emplace_back(pose);
    tracer.set(there.views(), tracks);
    for (u32 const most : {0u, 3u}) {
      options.max_hits = most;
      gart::traced_rays const got = trace_all(exec, tracer, batch.rays(), options),
                              expected = gart_test::trace_all(exec, one, batch.rays(), options);
      gart::hit_lists const hits = tracer.list(batch.rays(), options).to_host(),
                            wanted = one.list(batch.rays(), options).to_host();
      if (bits) {
        CHECK(same(got, expected));
        CHECK(hits.offsets == wanted.offsets);
        CHECK(hits.ids == wanted.ids);
        CHECK(hits.t == wanted.t);
        CHECK(hits.alpha == wanted.alpha);
        CHECK(hits.weight == wanted.weight);
      }
      // Gaussians that are turned are rounded: a hit at the edge may be one or none, and neighbours change places.
      std::size_t compared = 0;
      for (std::size_t r = 0; r < 300; ++r) {
        CAPTURE(r);
        std::size_t const begin = wanted.offsets[r], count = wanted.offsets[r + 1] - begin, at = hits.offsets[r];
        bool alike = hits.offsets[r + 1] - at == count;
        for (std::size_t k = 0; alike && k < count; ++k) alike = hits.ids[at + k] == wanted.ids[begin + k];
        if (!alike) continue;
        ++compared;
        CHECK(got.depth[r] == doctest::Approx(expected.depth[r]).epsilon(1e-3));
        for (std::size_t c = 0; c < 3; ++c)
          CHECK(got.color[3 * r + c] == doctest::Approx(expected.color[3 * r + c]).epsilon(1e-3));
      }
      CHECK(compared > 240);
      if (compared > 0 && !hits.ids.empty()) {
        gart::instance_gaussian const a = tracer.of(hits.ids[0]), b = set.of(hits.ids[0]);
        CHECK(a.instance == b.instance);
        CHECK(a.gaussian == b.gaussian);
      }
    }
  };
  compare({{0}, {1}}, true);
  compare({{1, matrix_of(turned({1, 2, 3}, 0.8)), {0.4, 0.1, -0.3}},
           {0, matrix_of(turned({-1, 0, 1}, 2.2)), {-0.5, 0.3, 0.2}, 1.3},
           {1, matrix_of(turned({0, 1, 1}, -1.2)), {0.1, -0.6, 0.4}}},
          false);
}

TEST_CASE_TEMPLATE("a sweep sees a car where it is at each ray's time", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  moving_scene const scene(seed, 80);
  placed_models<E> const there(exec, scene.models);
  gart::actor_tracer<E> tracer(exec);
  // The sensor drives too, far from the world's origin as the actors are.
  vec3d const far(3e5, -2e5, 40);
  std::vector<instance_track> actors = scene.actors();
  for (instance_track& track : actors)
    for (instance& pose : track.poses) pose.position += far;
  tracer.set(there.views(), actors);
  gart::sensor_pose sensor;
  sensor.position = far + vec3d(-0.4, 0.3, 0.2), sensor.travel = gart::vec3(0.5f, -0.1f, 0), sensor.turn.z = 0.1f;
  gart::ray_list const list = gart::rays_of(gart::spinning_lidar({-0.4f, -0.2f, 0, 0.2f, 0.4f}, 48), sensor);
  std::size_t const n = list.times.size();
  REQUIRE(n == 240);
  batch_memory<E> const batch(exec, list.frame, list.origins, list.directions);
  gart::buffer<float, E> const times(exec, list.times);
  gart::ray_batch rays = batch.rays();
  rays.times = times;
  gart::traced_rays const got = trace_all(exec, tracer, rays, sweep_options());

  std::vector<double_model> const models{double_model(scene.models[0]), double_model(scene.models[1])};
  std::vector<double> const still(6 * scene.keys());
  std::vector<std::array<double, 6>> const unmoved(3, std::array<double, 6>{});
  std::size_t compared = 0, of_cars = 0;
  for (std::size_t i = 0; i < n; ++i) {
    CAPTURE(i);
    double_ray r{{}, {}};
    for (std::size_t k = 0; k < 3; ++k)
      r.origin[k] = double{list.origins[3 * i + k]}, r.direction[k] = double{list.directions[3 * i + k]};
    std::vector<instance> poses;
    std::size_t key = 0;
    for (double_track const& t : scene.tracks) {
      poses.push_back(t.at(double{list.times[i]}, &still[6 * key]));
      poses.back().position -= list.frame - far;
      key += t.times.size();
    }
    double_model const now = scene_of(models, poses, unmoved);
    for (ray_weights const& by : {ray_weights{{0.3, -0.2, 0.5}, 0, 0.4}, ray_weights{{0, 0, 0}, 1, 0}}) {
      seen const expected = see(now, r, by, sweep_options());
      if (expected.weights.size() != got.hits[i]) continue;
      ++compared;
      for (auto const& hit : expected.weights) of_cars += hit.first >= 80;
      CHECK(dot(by, got, i) == doctest::Approx(expected.loss).epsilon(1e-3));
    }
  }
  CHECK(compared > 400);
  CHECK(of_cars > 1000);
}

TEST_CASE_TEMPLATE("gradients of actors are differences of models, keys and rays", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  moving_scene const scene(seed, 14);
  placed_models<E> const there(exec, scene.models);
  sweep const s(seed + 2, 40);
  std::vector<float> when;
  for (std::size_t i = 0; i < s.count(); ++i) when.push_back(static_cast<float>(i) / 39.0f);
  traced_sweep<E> const traced(exec, s);
  gart::buffer<float, E> const times(exec, when);
  gart::ray_batch rays = traced.rays.rays();
  rays.times = times;
  gart::actor_tracer<E> tracer(exec);
  tracer.set(there.views(), scene.actors());
  auto const context = tracer.forward(rays, sweep_options());
  std::vector<gart::gaussians<E>> by_models;
  std::vector<gart::gaussians_view<float>> targets;
  for (auto const& m : scene.models) by_models.emplace_back(exec, m.size(), m.sh_degree);
  for (auto& m : by_models) targets.push_back(m.view());
  gart::buffer<float, E> const by_keys(exec, 6 * scene.keys());
  gart::buffer<float, E> const by_origins(exec, 3 * s.count()), by_directions(exec, 3 * s.count());
  gart::actor_gradients to;
  to.models = targets, to.keys = by_keys.data();
  tracer.backward(context, traced.by(), to, {by_origins.data(), by_directions.data()});
  std::vector<float> const keys = by_keys.to_host(), origins = by_origins.to_host(),
                           directions = by_directions.to_host();
  gart::gaussian_model const first = by_models[0].to_host();
  // Again, with other batches in between: the same bits.
  trace_all(exec, tracer, rays, {});
  tracer.backward(context, traced.by(), to, {by_origins.data(), by_directions.data()});
  CHECK(by_keys.to_host() == keys);
  CHECK(same_bits(by_models[0].to_host(), first));

  std::vector<double_model> models{double_model(scene.models[0]), double_model(scene.models[1])};
  std::vector<double> moved(6 * scene.keys());
  std::vector<std::array<double, 6>> const unmoved(3, std::array<double, 6>{});
  auto const of_ray = [&](std::size_t i, double_ray const& r) {
    std::vector<instance> poses;
    std::size_t key = 0;
    for (double_track const& t : scene.tracks) {
      poses.push_back(t.at(double{when[i]}, &moved[6 * key]));
      key += t.times.size();
    }
    return see(scene_of(models, poses, unmoved), r, s.weights(i), sweep_options());
  };
  auto const loss = [&] { return see_all(s, [&](std::size_t i) { return of_ray(i, s.ray(i)); }); };
  // What is differentiated is what was shown.
  gart::traced_rays const shown = trace_all(exec, tracer, rays, sweep_options());
  double total = 0;
  for (std::size_t i = 0; i < s.count(); ++i) total += dot(s.weights(i), shown, i);
  CHECK(total == doctest::Approx(loss().loss).epsilon(1e-3));

  kept_slopes kept("actors");
  std::size_t used = 0, tried = 0;
  auto const check = [&](std::vector<double>& values, std::vector<float> const& by, char const* what, double bound) {
    CAPTURE(what);
    comparison c;
    std::size_t const step = values.size() > 40 ? values.size() / 20 : 1;
    for (std::size_t i = 0; i < values.size(); i += step) {
      ++tried;
      auto const expected = slope(kept, values[i], loss);
      if (!expected) continue;
      ++used;
      c.add(double{by[i]}, *expected);
    }
    CHECK(c.relative() < bound);
  };
  for (std::size_t m = 0; m < 2; ++m) {
    CAPTURE(m);
    gart::gaussian_model const got = by_models[m].to_host();
    check(models[m].mean, got.mean, "mean", 2e-4);
    check(models[m].log_scale, got.log_scale, "log-scale", 2e-4);
    check(models[m].quaternion, got.quaternion, "quaternion", 2e-4);
    check(models[m].opacity, got.opacity, "opacity", 2e-4);
    check(models[m].sh, got.sh, "SH", 2e-4);
  }
  check(moved, keys, "keys", 2e-4);
  CHECK(used > tried * 3 / 4);

  comparison origin, direction;
  for (std::size_t i = 0; i < s.count(); ++i) {
    double_ray r = s.ray(i);
    auto const alone = [&] { return of_ray(i, r); };
    for (std::size_t k = 0; k < 3; ++k) {
      if (auto const of = slope(kept, r.origin[k], alone)) origin.add(double{origins[3 * i + k]}, *of);
      if (auto const of = slope(kept, r.direction[k], alone)) direction.add(double{directions[3 * i + k]}, *of);
    }
  }
  CHECK(origin.relative() < 2e-4);
  CHECK(direction.relative() < 2e-4);

  // Parts that are not wanted are left out.
  gart::buffer<float, E> const alone(exec, 6 * scene.keys());
  gart::actor_gradients of_keys;
  of_keys.keys = alone.data();
  tracer.backward(context, traced.by(), of_keys);
  CHECK(alone.to_host() == keys);
}

TEST_CASE_TEMPLATE("what rays among actors cannot be is refused by name", E, GART_TEST_POLICIES) {
  E exec;
  moving_scene const scene(3, 20);
  placed_models<E> const there(exec, scene.models);
  gart::actor_tracer<E> tracer(exec);
  random_rays const some(4, 10, 1.0f);
  batch_memory<E> const batch(exec, {}, some.origins, some.directions);
  target_memory<E> const out(exec, 10);
  auto const trace = [&](std::vector<float> const& when) {
    gart::buffer<float, E> const times(exec, when);
    gart::ray_batch rays = batch.rays();
    rays.times = times;
    tracer.trace(rays, {}, out.targets());
  };
  refused([&] { trace({}); }, "call actor_tracer.set first");
  tracer.set(there.views(), scene.actors());
  std::vector<float> when(10, 0.5f);
  trace(when);
  // The ends are covered, as far as the rays' times resolve them.
  when[0] = 0, when[9] = 1;
  trace(when);
  refused([&] { trace({}); }, "ray_batch.times is empty, and actors[2] moves");
  refused([&] { trace({0.5f, 0.5f}); }, "ray_batch.times has 2 numbers, and 10 directions ask for 10");
  when[7] = std::numeric_limits<float>::quiet_NaN();
  refused([&] { trace(when); }, "ray_batch.times[7] is nan, which is no number");
  when[7] = 0.5f, when[4] = 1.2f;
  refused([&] { trace(when); }, "ray_batch.times[4] is 1.2");
  refused([&] { trace(when); }, "the track of actors[2] goes from 0.000000 to 1.000000");
  when[4] = -0.05f;
  refused([&] { trace(when); }, "the track of actors[2] goes from");
  gart::batch_targets features = out.targets();
  features.channels.features = out.color.data();
  refused([&] { tracer.trace(batch.rays(), {}, features); }, "asks for features");

  auto const set = [&](auto&& change) {
    std::vector<instance_track> actors = scene.actors();
    change(actors);
    tracer.set(there.views(), actors);
  };
  double const nan = std::numeric_limits<double>::quiet_NaN();
  refused([&] { set([](auto& a) { a.clear(); }); }, "there are no actors");
  refused([&] { set([](auto& a) { a[0].poses.clear(); }); }, "actors[0].poses is empty");
  refused([&] { set([](auto& a) { a[1].times.pop_back(); }); }, "actors[1] has 2 times and 3 poses");
  refused([&] { set([&](auto& a) { a[1].times[1] = nan; }); }, "actors[1].times[1] is not finite");
  refused([&] { set([](auto& a) { a[1].times[2] = 0.4; }); }, "actors[1].times[2] is not after the one before");
  refused([&] { set([](auto& a) { a[1].poses[2].model = 0; }); }, "actors[1].poses[2].model is another");
  refused([&] { set([](auto& a) { a[0].poses[0].model = 2; }); }, "actors[0].poses[0].model is 2, and there are 2");
  refused([&] { set([](auto& a) { a[2].poses[1].scale = 2; }); }, "actors[2].poses[1].scale is another");
  refused([&] { set([&](auto& a) { a[2].poses[1].position.x = nan; }); }, "actors[2].poses[1].position is not finite");
  refused([&] { set([](auto& a) { a[2].poses[0].rotation *= 1.1; }); }, "actors[2].poses[0].rotation is none");

  when[4] = 0.5f;
  gart::buffer<float, E> const times(exec, when), shorter(exec, 7);
  gart::ray_batch rays = batch.rays();
  rays.times = times;
  auto context = tracer.forward(rays, {});
  gart::output_gradients by;
  by.color = shorter;
  refused([&] { tracer.backward(context, by, {}); }, "output_gradients.color has 7 numbers");
  gart::gaussians<E> fewer(exec, 3, 3);
  std::vector<gart::gaussians_view<float>> const one{fewer.view()}, two{fewer.view(), fewer.view()};
  gart::actor_gradients to;
  to.models = one;
  refused([&] { tracer.backward(context, {}, to); }, "models has 1 models, and there are 2");
  to.models = two;
  refused([&] { tracer.backward(context, {}, to); }, "models[0] must have the number");
  gart::actor_tracer<E> other(exec);
  refused([&] { other.backward(context, {}, {}); }, "the context is of another tracer");
  tracer.set(there.views(), scene.actors());
  refused([&] { tracer.backward(context, {}, {}); }, "actor_tracer.set was called since forward()");
}
