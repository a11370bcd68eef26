// gart mesh: the surface of what rays meet, its distance to a known one, and files of meshes.

#include "program.hpp"

#include <gart/io/camera_file.hpp>
#include <gart/io/mesh_file.hpp>

#include <doctest/doctest.h>

#include "mesh/mesh_distance.hpp"
#include "mesh/mesh_fusion.hpp"
#include "mesh/mesh_parts.hpp"

#include <cmath>
#include <numbers>

using namespace cli_test;
using gart::vec3;
using gart::vec3d;

namespace {

gart::triangle_mesh sphere(double radius, int rings = 64) {
  gart::triangle_mesh m;
  int const around = 2 * rings;
  for (int i = 0; i <= rings; ++i)
    for (int k = 0; k < around; ++k) {
      double const a = std::numbers::pi * i / rings, b = 2 * std::numbers::pi * k / around;
      m.position.push_back(vec3(vec3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)) * radius));
    }
  auto const at = [&](int i, int k) { return static_cast<gart::u32>(i * around + k % around); };
  for (int i = 0; i < rings; ++i)
    for (int k = 0; k < around; ++k) {
      m.triangle.push_back({at(i, k), at(i + 1, k), at(i + 1, k + 1)});
      m.triangle.push_back({at(i, k), at(i + 1, k + 1), at(i, k + 1)});
    }
  return m;
}

// Cameras on a sphere of radius 4 that look at its middle.
std::vector<gart::named_camera> cameras(int count, int size = 64) {
  std::vector<gart::named_camera> all;
  for (int i = 0; i < count; ++i) {
    double const z = -0.9 + 1.8 * (i + 0.5) / count, a = 2.4 * i, r = std::sqrt(1 - z * z);
    vec3d const out(r * std::cos(a), r * std::sin(a), z), right(-std::sin(a), std::cos(a), 0);
    gart::camera c;
    c.width = c.height = size;
    c.fx = c.fy = 1.5f * static_cast<float>(size);
    c.cx = c.cy = 0.5f * static_cast<float>(size);
    c.rotation = gart::mat3(vec3(right), vec3(glm::cross(-out, right)), vec3(-out));
    c.position = 4.0 * out;
    all.push_back({"c" + std::to_string(i), c});
  }
  return all;
}

// Rays that meet the sphere of radius 1 around `at`.
std::vector<gart_cli::met_ray> rays_on_sphere(gart::camera const& c, vec3d const& at) {
  std::vector<gart_cli::met_ray> rays;
  for (int y = 0; y < c.height; ++y)
    for (int x = 0; x < c.width; ++x) {
      vec3d const local((x + 0.5 - c.width / 2.0) / c.fx, (y + 0.5 - c.height / 2.0) / c.fy, 1);
      vec3d const d = glm::normalize(gart::mat3d(c.rotation) * local), o = c.position + at;
      double const b = glm::dot(o - at, d), q = b * b - glm::dot(o - at, o - at) + 1;
      rays.push_back({o, vec3(d), q > 0 ? static_cast<float>(-b - std::sqrt(q)) : 0.0f});
    }
  return rays;
}

double area_of(gart::triangle_mesh const& m) {
  double sum = 0;
  for (auto const& t : m.triangle)
    sum += 0.5 * glm::length(glm::cross(vec3d(m.position[t[1]] - m.position[t[0]]),
                                        vec3d(m.position[t[2]] - m.position[t[0]])));
  return sum;
}

}  // namespace

TEST_CASE("meshes are written and read again, and by others' ways") {
  folder const here;
  auto const ball = sphere(1, 8);
  gart::write_mesh_ply(here / "ball.ply", ball);
  auto const back = gart::read_mesh_ply(here / "ball.ply");
  CHECK(back.triangle == ball.triangle);
  CHECK(back.position == ball.position);
  vec3d const survey(5e5, 4e6, 100);
  gart::write_mesh_ply(here / "far.ply", ball, survey);
  auto const far = gart::read_mesh_ply(here / "far.ply", survey);
  for (std::size_t i = 0; i < far.position.size(); ++i) CHECK(glm::length(far.position[i] - ball.position[i]) < 1e-6f);
  std::string const head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float z\nproperty float y\nproperty float x\nproperty uchar "
      "red\n"
      "element face 1\nproperty list uchar int vertex_index\nend_header\n";
  gart::write_file(here / "square.ply", head + "0 0 0 9\n0 0 1 9\n0 1 1 9\n0 1 0 9\n4 0 1 2 3\n");
  auto const square = gart::read_mesh_ply(here / "square.ply");
  CHECK(area_of(square) == doctest::Approx(1));
  CHECK(square.triangle == std::vector<std::array<gart::u32, 3>>{{0, 1, 2}, {0, 2, 3}});
  auto const refused = [&](std::string const& text) {
    gart::write_file(here / "bad.ply", text);
    try {
      gart::read_mesh_ply(here / "bad.ply");
    } catch (gart::io_error const& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK(
      has(refused(head + "0 0 0 9\n0 0 1 9\n0 1 1 9\n0 1 0 9\n3 0 1 4\n"), "a face has the corner 4, and there are 4"));
  CHECK(has(refused(head + "0 0 0 9\n0 nan 1 9\n0 1 1 9\n0 1 0 9\n3 0 1 2\n"), "vertex 1 is not finite"));
  CHECK(has(refused(head + "0 0 0 9\n0 0 1 9\n0 1 1 9\n0 1 0 9\n4 0 1 2\n"), "ends at face 0"));
  gart::write_splat_ply(here / "one.ply", one_gaussian());
  CHECK(has(refused(text_of(here / "one.ply")), "has no vertices, or no faces"));
}

TEST_CASE("the distance of two spheres is that of their radii") {
  auto const views = cameras(20);
  auto const same = gart_cli::score_mesh(sphere(1), sphere(1, 60), views, 0.01);
  CHECK(same.mean < 1e-3);
  CHECK(same.f_score == 1);
  auto const apart = gart_cli::score_mesh(sphere(1.05), sphere(1), views, 0.02);
  CHECK(apart.to_reference == doctest::Approx(0.05).epsilon(0.02));
  CHECK(apart.to_mesh == doctest::Approx(0.05).epsilon(0.02));
  CHECK(apart.f_score == 0);
  // Half of the sphere: what is there is right, half of what is seen is not there.
  auto half = sphere(1);
  half.triangle.resize(half.triangle.size() / 2);
  auto const part = gart_cli::score_mesh(half, sphere(1), views, 0.005);
  CHECK(part.precision == 1);
  CHECK(part.recall == doctest::Approx(0.5).epsilon(0.1));
  // What no camera sees counts for nothing: a small sphere within.
  auto both = sphere(1), inner = sphere(0.3, 16);
  gart::u32 const before = static_cast<gart::u32>(both.position.size());
  both.position.insert(both.position.end(), inner.position.begin(), inner.position.end());
  for (auto t : inner.triangle) both.triangle.push_back({before + t[0], before + t[1], before + t[2]});
  CHECK(gart_cli::score_mesh(sphere(1), both, views, 0.01).recall == 1);
  CHECK(gart_cli::large_parts(both, 16 * 64 + 1).triangle.size() == sphere(1).triangle.size());
  auto const samples = gart_cli::even_samples(sphere(2), 1000);
  CHECK(samples.size() >= 998);
  CHECK(samples.size() <= 1000);
}

TEST_CASE("rays on a sphere make the mesh of a sphere") {
  try {
    for (vec3d const& at : {vec3d(0.0), vec3d(-1.5, 0.7, 3)}) {
      gart_cli::fusion fused({.voxel = 0.04});
      for (auto const& c : cameras(40)) fused.add(rays_on_sphere(c.view, at));
      auto mesh = fused.mesh();
      for (vec3& p : mesh.position) p -= vec3(at);
      double inside = 0, volume = 0;
      for (vec3 const& p : mesh.position) inside = std::max(inside, std::abs(double{glm::length(p)} - 1));
      CHECK(inside < 0.02);
      for (auto const& t : mesh.triangle)
        volume += glm::dot(mesh.position[t[0]], glm::cross(mesh.position[t[1]], mesh.position[t[2]])) / 6;
      CHECK(volume == doctest::Approx(4.18879).epsilon(0.02));  // positive: counter-clockwise from outside
      CHECK(area_of(mesh) == doctest::Approx(12.566).epsilon(0.05));
      auto const score = gart_cli::score_mesh(mesh, sphere(1), cameras(20), 0.02);
      CHECK(score.mean < 0.004);
      CHECK(score.f_score > 0.999);
    }
    // What one side has seen is no closed surface.
    gart_cli::fusion fused({.voxel = 0.04});
    for (int i = 0; i < 4; ++i) fused.add(rays_on_sphere(cameras(1)[0].view, vec3d(0.0)));
    for (vec3 const& p : fused.mesh().position) CHECK(std::abs(glm::length(p) - 1) < 0.06f);
    CHECK_THROWS_AS(gart_cli::fusion({.voxel = 0}), gart::invalid_argument);
  } catch (gart::unsupported const& e) {
    CHECK(has(e.what(), "libopenvdb-dev"));
    MESSAGE("skipped: ", std::string(e.what()));
  }
}

TEST_CASE("gart mesh finds the surface of Gaussians") {
  folder const here;
  // Flat Gaussians on a sphere, opaque.
  auto const ball = sphere(1, 24);
  gart::gaussian_model m;
  std::vector<vec3> const places = gart_cli::even_samples(ball, 4000);
  m.resize(places.size(), 0);
  for (std::size_t i = 0; i < places.size(); ++i) {
    vec3d const n = glm::normalize(vec3d(places[i]));
    vec3d const half = glm::normalize(n + vec3d(0, 0, 1.0000001));  // a half turn about it takes z to n
    for (std::size_t k = 0; k < 3; ++k) {
      m.mean[3 * i + k] = static_cast<float>(n[static_cast<int>(k)]);
      m.log_scale[3 * i + k] = k < 2 ? -3.2f : -7.0f;
      m.quaternion[4 * i + 1 + k] = static_cast<float>(half[static_cast<int>(k)]);
    }
    m.opacity[i] = 4;
  }
  gart::write_splats(here / "ball.ply", m, {{"origin", "500000,4000000,100"}});
  auto views = cameras(24, 96);
  for (auto& c : views) c.view.position += vec3d(5e5, 4e6, 100);
  gart::write_cameras(here / "cameras.json", views);
  gart::write_mesh_ply(here / "sphere.ply", sphere(1), vec3d(5e5, 4e6, 100));
  auto const made =
      here.gart("mesh ball.ply cameras.json --out mesh.ply --against sphere.ply --json scores.json --least-part 50");
  if (made.code != 0 && has(made.err, "libopenvdb-dev")) return;
  REQUIRE_MESSAGE(made.code == 0, made.err);
  CHECK(has(made.out, "mean distance "));
  auto const scores = here.json("scores.json");
  CHECK(scores["mean_distance"].get<double>() < 0.005 * scores["extent"].get<double>());
  CHECK(scores["f_score"].get<double>() > 0.95);
  auto const mesh = gart::read_mesh_ply(here / "mesh.ply", vec3d(5e5, 4e6, 100));
  CHECK(area_of(mesh) == doctest::Approx(12.566).epsilon(0.15));
  CHECK(has(here.gart("mesh ball.ply nowhere --out m.ply").err, "nowhere"));
  auto const large = here.gart("mesh ball.ply cameras.json --out m.ply --voxel 100");
  CHECK(large.code == 1);
  CHECK_MESSAGE(has(large.err, "voxels of 100 are too large where a pixel is 0.0"), large.err);
  CHECK(has(large.err, "(give smaller ones, as --voxel 0.0"));
  auto const little = here.gart("mesh ball.ply cameras.json --out m.ply --voxel 1e-5");
  CHECK(little.code == 1);
  CHECK_MESSAGE(has(little.err, "are too small where a pixel is 0.0"), little.err);
  CHECK(has(little.err, "(give larger ones, as --voxel 0.0"));
  CHECK_FALSE(has(little.err, "fused"));  // refused before the work
  CHECK_FALSE(fs::exists(here / "m.ply"));
}
