// Where light ends: a light's rays go no farther than the light, and none is thrown into a surface whose normal for
// shading leans.
#include <light/small_scenes.hpp>

#include <cmath>

using namespace gart_test;

namespace {

// Gaussians that nobody sees.
gart::gaussian_model nothing() { return cloud(1, 1, {0, 0, -50}, 0.1f); }

}  // namespace

TEST_CASE_TEMPLATE("what lies behind a light throws no shadow", E, GART_TEST_POLICIES) {
  E exec;
  light::scene scene;
  light::light lamp;
  lamp.color = vec3(3.0f), lamp.position = {0.3f, -0.2f, 2};
  scene.lights = {lamp};
  scene.materials = {matt(vec3(0.5f))};
  scene.meshes = {quad({0, 0, 4}, {3, 0, 0}, {0, 3, 0}, 0)};
  gart::camera const view = camera_at({}, 9, 7, 12);
  for (bool const behind : {false, true}) {
    CAPTURE(behind);
    if (behind) scene.meshes.push_back(quad({0, 0, -1}, {50, 0, 0}, {0, 50, 0}, 0));
    std::vector<float> const got = picture(exec, nothing(), scene, view, {}, through_middles(1));
    for (int y = 0; y < view.height; ++y)
      for (int x = 0; x < view.width; ++x) {
        vec3d const d(gart::ray_direction(view, static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f));
        vec3d const to = vec3d(lamp.position) - d * (4 / d.z);
        double const length2 = glm::dot(to, to), cosine = -to.z / std::sqrt(length2);
        double const expected = 0.5 / 3.141592653589793 * 3 * cosine / length2;
        CHECK(double{got[static_cast<std::size_t>(3 * (y * view.width + x))]} ==
              doctest::Approx(expected).epsilon(1e-4));
      }
  }
}

TEST_CASE_TEMPLATE("a mirror whose normals lean throws nothing into itself", E, GART_TEST_POLICIES) {
  E exec;
  light::scene scene;
  scene.materials = {material_of(light::material_kind::mirror, {1, 1, 1}), glowing(vec3(1.0f))};
  // A floor that is grazed, and what glows above it.
  light::mesh floor = quad({0, 1, 10}, {20, 0, 0}, {0, 0, 9}, 0);
  vec3 const up = glm::normalize(glm::cross(vec3(20, 0, 0), vec3(0, 0, 9)));
  floor.normals.assign(floor.positions.size(), glm::normalize(vec3(1, 0, 0) + 0.2f * up));
  scene.meshes = {floor, quad({0, -10, 60}, {40, 0, 0}, {0, 10.9f, 0}, 1)};
  gart::camera const view = camera_at({}, 8, 8, 40);
  std::vector<float> const got = picture(exec, nothing(), scene, view, {}, through_middles(1));
  for (int y = 6; y < 8; ++y)
    for (int x = 0; x < 8; ++x) CHECK(got[static_cast<std::size_t>(3 * (8 * y + x))] == doctest::Approx(1));
}
