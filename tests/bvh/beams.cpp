// Rays that go through the tree as beams (trace/beam_walk.hpp), and those that do not: every ray's hits are what each
// Gaussian says by itself, whatever waits, is lost or has no room.
#include <bvh/ray_hits.hpp>

#include <gart/trace/beam_rays.hpp>

#include <limits>
#include <random>

using namespace gart_test;

namespace {

vec3 unit(vec3 const& v) { return v / std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z); }

// Rays about one, as far from it as `spread` says.
std::vector<gart::ray> rays_about(std::mt19937_64& random, vec3 at, vec3 towards, float spread, int count,
                                  float apart = 0) {
  std::normal_distribution<float> normal;
  std::vector<gart::ray> out;
  for (int i = 0; i < count; ++i) {
    auto const off = [&](float by) { return by * vec3(normal(random), normal(random), normal(random)); };
    vec3 const o = at + off(apart);
    out.push_back({o, unit(unit(towards) + off(spread))});
  }
  return out;
}

gart::gaussian_model cloud_of(std::mt19937_64& random, int count, float least, float most, float reach) {
  std::uniform_real_distribution<float> at(-reach, reach), size(least, most);
  gart::gaussian_model model;
  for (int i = 0; i < count; ++i) add(model, {at(random), at(random), at(random)}, std::exp(size(random)), at(random));
  return model;
}

}  // namespace

TEST_CASE_TEMPLATE("beams of every direction and width", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  std::normal_distribution<float> normal;
  E exec;
  auto const model = cloud_of(random, 3000, -3, 0, 3);
  // Along an axis, along none, and so wide that rays are walked alone; the last beam is not full.
  for (float const spread : {0.0f, 1e-4f, 0.01f, 0.05f, 0.5f}) {
    CAPTURE(spread);
    std::vector<gart::ray> rays;
    for (vec3 const d : {vec3(0, 0, 1), vec3(-1, 0, 0), vec3(0, -1, 1e-9f), vec3(normal(random), 1, normal(random))}) {
      auto const some = rays_about(random, {normal(random), normal(random), normal(random)}, d, spread, 32, spread);
      rays.insert(rays.end(), some.begin(), some.end());
    }
    rays.resize(rays.size() - 7);
    check_rays(exec, model, rays, 0.01f, 0, windows::with_tree);
  }
}

TEST_CASE_TEMPLATE("thousands of hits a ray of a beam", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed() + 1);
  std::uniform_real_distribution<float> depth(0.5f, 20.0f), beside(-0.02f, 0.02f);
  E exec;
  gart::gaussian_model model;
  SUBCASE("along it") {
    for (int i = 0; i < 3000; ++i) add(model, {beside(random), beside(random), depth(random)}, 0.05f);
  }
  SUBCASE("at one place") {
    for (int i = 0; i < 3000; ++i) add(model, {0.01f, 0, 3}, 0.1f);
  }
  SUBCASE("in groups at one distance") {
    for (int i = 0; i < 40; ++i)
      for (int k = i; k < 40; ++k)
        add(model, {0.01f * static_cast<float>(i % 3), 0, 1.0f + static_cast<float>(k)}, 0.1f);
  }
  auto rays = rays_about(random, vec3(0.0f), vec3(0, 0, 1), 1e-3f, 31);
  rays.push_back({vec3(0.0f), vec3(0, 0, 1)});
  check_rays(exec, model, rays, 0.01f, 1, windows::with_tree);
}

// All boxes hold the beam's origin: nodes come at one distance, more than there is room for.
TEST_CASE_TEMPLATE("rays that begin inside of all Gaussians", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed() + 2);
  E exec;
  auto const model = cloud_of(random, 8000, 1.0f, 2.0f, 2);
  check_rays(exec, model, rays_about(random, vec3(0.0f), vec3(1, 2, -1), 0.01f, 32, 0.01f), 0.01f, 100,
             windows::with_tree);
}

#if !defined(GART_TEST_CUDA)  // of a host's tree
TEST_CASE("a beam crosses what its rays cross, and no later") {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed() + 3);
  std::uniform_real_distribution<float> unit_interval(0, 1);
  std::normal_distribution<float> normal;
  gart::serial_exec exec;
  long crossed = 0, missed = 0, late = 0;
  for (int scene = 0; scene < 300; ++scene) {
    float const reach = scene % 3 ? 3.0f : 1e6f, spread = std::pow(10.0f, -4 * unit_interval(random));
    std::vector<gart::box> boxes(64);
    for (auto& b : boxes) {
      vec3 const at = reach * vec3(normal(random), normal(random), normal(random));
      vec3 const half = 0.5f * std::abs(normal(random)) * vec3(unit_interval(random), unit_interval(random), 1);
      b = {at - half, at + half};
    }
    gart::bvh<gart::serial_exec> tree(exec);
    tree.build(exec, boxes);
    vec3 towards(normal(random), normal(random), normal(random));
    if (scene % 2) towards[scene % 3] = 0;
    auto const rays = rays_about(random, {normal(random), normal(random), 0}, towards, 0.1f * spread, 32, spread);
    auto const made = gart::beam_of(
        tree.view(), [](int) { return true; }, [&](int l) { return gart::place(rays[static_cast<std::size_t>(l)]); });
    if (!made.narrow) continue;
    for (gart::index_t node = 0; node < 8; ++node) {
      gart::bvh_node const& n = tree.view().nodes[node];
      if (n.inner_count() + n.leaf_count() == 0) break;
      float by_beam[gart::bvh_width], by_ray[gart::bvh_width];
      u32 const all = gart::cross_children(n, made.bounds, 0.0f, by_beam);
      for (auto const& r : rays) {
        u32 const own = gart::cross_children(n, gart::slab_ray(r), 0, std::numeric_limits<float>::max(), by_ray) &
                        (n.inner_mask() | n.leaf_mask());
        missed += (own & ~all) != 0;
        for (int c = 0; c < gart::bvh_width; ++c) {
          if (!(own >> c & 1u)) continue;
          ++crossed;
          late += by_beam[c] > by_ray[c];
        }
      }
    }
  }
  CHECK(crossed > 1000);
  CHECK(missed == 0);
  CHECK(late == 0);
}
#endif
