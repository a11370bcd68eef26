// Actors that move while a lidar looks about, traced in slices of time: against a sensor that moves the other way, past
// an actor at rest.
#include <gart/instances/instance_set.hpp>
#include <gart/instances/instance_track.hpp>
#include <gart/rays/lidar.hpp>

#include <rays/view_rays.hpp>

#include <cmath>

using namespace gart_test;
using gart::instance;
using gart::mat3d;
using gart::vec3d;

TEST_CASE_TEMPLATE("a lidar sees a moving actor as it stands at each time", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  E exec;
  gart::gaussian_model const model = cloud(seed, 3, 150);
  gart::gaussians<E> const there(exec, model);
  constexpr int columns = 24;
  gart::lidar_pattern const pattern = gart::spinning_lidar({-0.3f, -0.1f, 0.1f, 0.2f}, columns);
  // About the middle of the sweep the actor is at the origin, in the world's axes.
  vec3d const way(0.8, -0.4, 0.2), turn(0.1, 0.2, 0.5), middle(-0.3, 0.2, 0.1);
  auto const at = [&](double time) { return instance{0, gart::turn_of(turn * (time - 0.5)), way * (time - 0.5)}; };
  gart::instance_set<E> set(exec, 3);
  set.set({there.view()}, {at(0.5)});
  gart::ray_tracer<E> tracer(exec);
  gart::render_options options;
  options.rebuild_every = 4;

  std::vector<float> color(3 * pattern.times.size()), depth(pattern.times.size());
  std::vector<gart::u32> hits(pattern.times.size());
  gart::sensor_pose sensor;
  sensor.position = middle;
  std::size_t seen = 0;
  for (int c = 0; c < columns; ++c) {
    float const from = static_cast<float>(c) / columns, to = static_cast<float>(c + 1) / columns;
    gart::lidar_slice const slice = gart::rays_during(pattern, from, to);
    REQUIRE(slice.rays.size() == 4);
    set.move({gart::between(at(0), at(1), double{from})});
    tracer.set_scene(set.scene(), 3);
    gart::ray_list const rays = gart::rays_of(slice.pattern, sensor);
    batch_memory<E> const batch(exec, rays.frame, rays.origins, rays.directions);
    gart::traced_rays const got = trace_all(exec, tracer, batch.rays(), options);
    for (std::size_t k = 0; k < 4; ++k, ++seen) {
      depth[slice.rays[k]] = got.depth[k], hits[slice.rays[k]] = got.hits[k];
      for (std::size_t i = 0; i < 3; ++i) color[3 * slice.rays[k] + i] = got.color[3 * k + i];
    }
  }
  CHECK(seen == pattern.times.size());

  // In the actor's axes each ray has an origin and a direction of its own.
  std::vector<float> origins, directions;
  for (std::size_t r = 0; r < pattern.times.size(); ++r) {
    instance const now = at(double{pattern.times[r]});
    vec3d const d(pattern.directions[3 * r], pattern.directions[3 * r + 1], pattern.directions[3 * r + 2]);
    vec3d const o = (middle - now.position) * now.rotation, own = d * now.rotation;
    for (int k = 0; k < 3; ++k)
      origins.push_back(static_cast<float>(o[k])), directions.push_back(static_cast<float>(own[k]));
  }
  batch_memory<E> const batch(exec, {}, origins, directions);
  gart::ray_tracer<E> at_rest(exec);
  at_rest.set_scene(there.view(), 3);
  gart::traced_rays const expected = trace_all(exec, at_rest, batch.rays(), {});
  std::size_t compared = 0, moved = 0;
  for (std::size_t r = 0; r < hits.size(); ++r) {
    CAPTURE(r);
    // A hit at the edge of its ellipsoid may be one or none.
    if (hits[r] != expected.hits[r]) continue;
    ++compared, moved += hits[r];
    CHECK(depth[r] == doctest::Approx(expected.depth[r]).epsilon(2e-3));
    for (std::size_t i = 0; i < 3; ++i)
      CHECK(color[3 * r + i] == doctest::Approx(expected.color[3 * r + i]).epsilon(2e-3));
  }
  CHECK(compared > hits.size() * 3 / 4);
  CHECK(moved > 3 * compared);
}

TEST_CASE("a pose between two is on the way") {
  instance const a{3, gart::turn_of({0.2, 0, 0}), {1, 2, 3}, 1.5}, b{3, gart::turn_of({1.4, 0, 0}), {3, 2, 1}, 1.5};
  auto const near = [](mat3d const& x, mat3d const& y) {
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) CHECK(std::abs(x[i][j] - y[i][j]) < 1e-12);
  };
  near(gart::between(a, b, 0).rotation, a.rotation);
  near(gart::between(a, b, 1).rotation, b.rotation);
  near(gart::between(a, b, 0.25).rotation, gart::turn_of({0.5, 0, 0}));
  CHECK(gart::between(a, b, 0.25).position == vec3d(1.5, 2, 2.5));
  CHECK(gart::between(a, b, 0.25).model == 3);
  CHECK(gart::between(a, b, 0.25).scale == 1.5);
  gart::lidar_pattern const no_times{{1, 0, 0}};
  CHECK_THROWS_WITH_AS(gart::rays_during(no_times, 0, 1), doctest::Contains("0 times in lidar_pattern"),
                       gart::invalid_argument);
}
