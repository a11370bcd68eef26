// Where the rays of a lidar begin and lead, by closed forms.
#include <gart/rays/lidar.hpp>

#include <doctest/doctest.h>

#include <cmath>

using doctest::Approx;

namespace {

constexpr double pi = 3.14159265358979323846;

gart::vec3d direction(gart::ray_list const& rays, std::size_t i) {
  float const* const d = &rays.directions[3 * i];
  return {d[0], d[1], d[2]};
}

void near(gart::vec3d const& a, gart::vec3d const& b) {
  for (int k = 0; k < 3; ++k) CHECK(std::abs(a[k] - b[k]) < 1e-6);
}

}  // namespace

TEST_CASE("a spinning lidar looks about, a row a beam") {
  gart::lidar_pattern const pattern = gart::spinning_lidar({0.0f, 0.5f}, 4, -2 * pi, 0, {0.0f, 0.1f});
  gart::ray_list const rays = gart::rays_of(pattern, {}, 30);
  REQUIRE(rays.batch().count() == 8);
  CHECK(rays.origins.empty());
  CHECK(rays.t_max == std::vector<float>(8, 30.0f));
  near(direction(rays, 0), {1, 0, 0});
  near(direction(rays, 1), {0, -1, 0});  // clockwise
  near(direction(rays, 2), {-1, 0, 0});
  double const azimuth = 0.1 - pi / 2;
  near(direction(rays, 5), {std::cos(0.5) * std::cos(azimuth), std::cos(0.5) * std::sin(azimuth), std::sin(0.5)});
  CHECK(pattern.times[3] == 0.75f);
  CHECK(pattern.times[5] == 0.25f);
  CHECK_NOTHROW(gart::require_batch(rays.batch()));
}

TEST_CASE("a sensor that moves has an origin and axes a ray") {
  gart::lidar_pattern pattern{{1, 0, 0, 3, 0, 0, 1, 0, 0}, {0, 0.5f, 1}};
  // Forward is the world's y, and it turns about its own z, which is the world's.
  gart::sensor_pose const pose{gart::mat3(0, 1, 0, -1, 0, 0, 0, 0, 1), gart::vec3d(1e6, 2, 3), gart::vec3(2, 0, 1),
                               gart::vec3(0, 0, 0.4f)};
  gart::ray_list const rays = gart::rays_of(pattern, pose);
  CHECK(rays.frame == pose.position);
  CHECK(rays.t_max.empty());
  std::vector<float> const origins{0, -1, -0.5f, 0, 0, 0, 0, 1, 0.5f};
  REQUIRE(rays.origins.size() == 9);
  for (std::size_t i = 0; i < 9; ++i) CHECK(rays.origins[i] == Approx(origins[i]));
  near(direction(rays, 0), {std::sin(0.2), std::cos(0.2), 0});
  near(direction(rays, 1), {0, 1, 0});
  near(direction(rays, 2), {-std::sin(0.2), std::cos(0.2), 0});
}

TEST_CASE("patterns that cannot be are refused") {
  auto const refused = [](auto&& call, char const* what) {
    CHECK_THROWS_WITH_AS(call(), doctest::Contains(what), gart::invalid_argument);
  };
  gart::sensor_pose moving;
  moving.travel.x = 1;
  refused([] { gart::spinning_lidar({0}, 0); }, "columns must be positive");
  refused([] { gart::spinning_lidar({0, 1}, 3, 6.28, 0, {0}); }, "1 azimuths and 2 elevations");
  refused([] { gart::rays_of({{1, 0}}, {}); }, "2 numbers of directions");
  refused([] { gart::rays_of({{1, 0, 0}, {0, 1}}, {}); }, "2 times");
  refused([] { gart::rays_of({{1, 0, 0, 0, 0, 0}}, {}); }, "lidar_pattern.directions[1] has no length");
  refused([&] { gart::rays_of({{1, 0, 0}, {1.5f}}, moving); }, "lidar_pattern.times[0]");
}
