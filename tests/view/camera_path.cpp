// A path goes through its keyframes, smoothly, and is the Catmull-Rom spline in its other form: the pyramid of straight
// lines of Barry and Goldman, in double.
#include "cameras.hpp"

#include <gart/core/error.hpp>
#include <gart/view/camera_path.hpp>

#include <doctest/doctest.h>

#include <cmath>

namespace {

using gart_test::camera_at;

double away(gart::vec3d const& a, gart::vec3d const& b) {
  gart::vec3d const d = a - b;
  return std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
}

double turned_between(gart::mat3 const& a, gart::mat3 const& b) {
  double trace = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) trace += static_cast<double>(a[i][j]) * static_cast<double>(b[i][j]);
  return std::acos(std::min(1.0, std::max(-1.0, (trace - 1) / 2)));
}

std::vector<gart::camera> some_keyframes() {
  std::vector<gart::camera> keys = {camera_at({0, 0, 0}, 0.1), camera_at({1, 0.5, 0}, 0.9),
                                    camera_at({1.1, 0.5, 0.2}, -0.4), camera_at({4, -1, 2}, 2.5),
                                    camera_at({4, 2, 2}, 2.5)};
  keys[1].fx = keys[1].fy = 90, keys[3].cx = 30;
  return keys;
}

}  // namespace

TEST_CASE("the path goes through every keyframe") {
  auto const keys = some_keyframes();
  for (bool closed : {false, true}) {
    gart::camera_path const path(keys, closed);
    for (std::size_t i = 0; i < keys.size() + closed; ++i) {
      gart::camera const &at = path.at(path.time_of(i)), &key = keys[i % keys.size()];
      CHECK(away(at.position, key.position) < 1e-9);
      CHECK(turned_between(at.rotation, key.rotation) < 1e-3);
      CHECK(at.fx == doctest::Approx(key.fx));
      CHECK(at.cx == doctest::Approx(key.cx));
    }
    CHECK(path.end() == path.time_of(keys.size() - !closed));
  }
}

TEST_CASE("positions are those of Barry and Goldman's pyramid") {
  auto const keys = some_keyframes();
  gart::camera_path const path(keys, true);
  std::size_t const n = keys.size();
  auto const length = [&](std::size_t i) { return path.time_of(i % n + 1) - path.time_of(i % n); };
  auto const place = [&](std::size_t i) { return keys[i % n].position; };
  for (std::size_t i = 0; i < n; ++i) {
    double const t0 = -length(i + n - 1), t2 = length(i), t3 = t2 + length(i + 1);
    for (double t : {0.1 * t2, 0.5 * t2, 0.8 * t2}) {
      auto const line = [&](gart::vec3d a, double from, gart::vec3d b, double to) {
        return ((to - t) * a + (t - from) * b) / (to - from);
      };
      gart::vec3d const a = line(place(i + n - 1), t0, place(i), 0), b = line(place(i), 0, place(i + 1), t2),
                        c = line(place(i + 1), t2, place(i + 2), t3);
      gart::vec3d const expected = line(line(a, t0, b, t2), 0, line(b, 0, c, t3), t2);
      CHECK(away(path.at(path.time_of(i) + t).position, expected) < 1e-9);
    }
  }
}

TEST_CASE("neither place nor direction jumps, and the axes stay axes") {
  for (bool closed : {false, true}) {
    gart::camera_path const path(some_keyframes(), closed);
    double const h = path.end() / 4000;
    gart::camera before = path.at(0);
    gart::vec3d speed{};
    for (int i = 1; i <= 4000; ++i) {
      gart::camera const now = path.at(i * h);
      gart::vec3d const v = (now.position - before.position) / h;
      if (i > 1) CHECK(away(v, speed) < 0.1);
      CHECK(turned_between(before.rotation, now.rotation) < 0.02);
      for (int a = 0; a < 3; ++a)
        for (int b = 0; b < 3; ++b)
          CHECK(std::abs(glm::dot(now.rotation[a], now.rotation[b]) - (a == b ? 1.0f : 0.0f)) < 1e-5f);
      before = now, speed = v;
    }
  }
}

TEST_CASE("even turns of keyframes stay even between, the short way") {
  std::vector<gart::camera> keys;
  for (int i = 0; i < 6; ++i) keys.push_back(camera_at({1.0 * i, 0, 0}, 1.2 * i));
  gart::camera_path const path(keys);
  for (double s : {0.05, 0.3, 0.5, 0.77, 0.99}) {
    gart::camera const at = path.at(s * path.end());
    CHECK(at.position.x == doctest::Approx(5 * s));
    CHECK(turned_between(at.rotation, camera_at({}, 1.2 * 5 * s).rotation) < 1e-3);
  }
}

TEST_CASE("frames: the ends of an open path, each once of a closed one") {
  auto const keys = some_keyframes();
  auto const open = gart::smooth_path(keys, 11), closed = gart::smooth_path(keys, 11, true);
  REQUIRE(open.size() == 11);
  REQUIRE(closed.size() == 11);
  CHECK(away(open.front().position, keys.front().position) < 1e-9);
  CHECK(away(open.back().position, keys.back().position) < 1e-9);
  CHECK(away(closed.back().position, keys.front().position) > 0.05);
}

TEST_CASE("given times are those of the keyframes and the end") {
  auto const keys = some_keyframes();
  for (bool closed : {false, true}) {
    std::vector<double> times = {0, 1, 1.5, 4, 5};
    if (closed) times.push_back(8);
    gart::camera_path const path(keys, closed, times);
    CHECK(path.end() == times.back());
    for (std::size_t i = 0; i < times.size(); ++i)
      CHECK(away(path.at(times[i]).position, keys[i % keys.size()].position) < 1e-9);
    auto const frames = gart::smooth_path(keys, closed ? 8 : 6, closed, times);
    CHECK(away(frames[1].position, keys[1].position) < 1e-9);  // a second each
  }
  for (std::vector<double> const& wrong :
       {std::vector<double>{0, 1}, {1, 2, 3, 4, 5}, {0, 1, 1, 2, 3}, {0, 2, 1, 3, 4}})
    CHECK_THROWS_AS(gart::camera_path(keys, false, wrong), gart::invalid_argument);
}

TEST_CASE("keyframes in one place turn; one pose alone is refused") {
  auto const turning = gart::smooth_path({camera_at({1, 1, 1}, 0), camera_at({1, 1, 1}, 1)}, 5);
  CHECK(turned_between(turning[2].rotation, camera_at({}, 0.5).rotation) < 1e-3);
  auto const standing = gart::smooth_path({camera_at({1, 1, 1}), camera_at({1, 1, 1}), camera_at({1, 1, 1})}, 7);
  for (auto const& c : standing) CHECK(away(c.position, {1, 1, 1}) < 1e-12);
  gart::camera sphere = camera_at({0, 0, 0});
  sphere.kind = gart::camera_kind::equirectangular, sphere.fx = sphere.fy = 0;
  CHECK(gart::smooth_path({sphere, sphere}, 3).size() == 3);
  CHECK_THROWS_AS(gart::smooth_path({sphere}, 3), gart::invalid_argument);
  CHECK_THROWS_AS(gart::smooth_path({sphere, camera_at({0, 0, 0})}, 3), gart::invalid_argument);
  CHECK_THROWS_AS(gart::smooth_path({sphere, sphere}, 1), gart::invalid_argument);
}
