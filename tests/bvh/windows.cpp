// The window of nearest hits, and rays with more hits than a window holds: resumed, nothing is lost or doubled.
#include <bvh/ray_hits.hpp>

#include <limits>
#include <random>

using namespace gart_test;

namespace {

template <int Capacity>
struct fill_window {
  hit const* stream;
  u32 const* lengths;
  int stride;
  hit* kept;  // [streams][Capacity]
  u32* sizes;
  float* far;  // [streams][stride + 1], before the first hit and after each
  GART_KERNEL void operator()(gart::index_t i) const {
    gart::k_buffer<Capacity> w;
    w.clear();
    float* const reach = far + static_cast<std::size_t>(i) * (stride + 1);
    reach[0] = w.far();
    for (u32 k = 0; k < lengths[i]; ++k) {
      hit const h = stream[static_cast<std::size_t>(i) * stride + k];
      if (w.wants(h.t, h.id)) w.insert(h);
      reach[k + 1] = w.far();
    }
    sizes[i] = static_cast<u32>(w.size());
    for (int k = 0; k < Capacity; ++k)
      if (k < w.size()) kept[static_cast<std::size_t>(i) * Capacity + k] = w[k];
  }
};

template <int Capacity, class E>
void check_window(E& exec, std::mt19937_64& random) {
  CAPTURE(Capacity);
  constexpr u32 streams = 500;
  constexpr int longest = 90;
  std::vector<hit> stream(streams * longest);
  std::vector<u32> lengths(streams);
  for (u32 i = 0; i < streams; ++i) {
    lengths[i] = static_cast<u32>(random() % (i % 2 ? longest : Capacity + 2));
    std::vector<u32> ids(longest);
    for (u32 k = 0; k < ids.size(); ++k) ids[k] = k;
    std::shuffle(ids.begin(), ids.end(), random);
    // Few distinct distances, so that many tie.
    int const distances = i % 3 ? 7 : 100000;
    for (int k = 0; k < longest; ++k)
      stream[i * longest + k] = {0.5f + static_cast<float>(random() % distances), ids[k], static_cast<float>(k)};
  }
  gart::buffer<hit, E> in(exec, stream), kept(exec, streams * Capacity);
  gart::buffer<u32, E> in_lengths(exec, lengths), sizes(exec, streams);
  gart::buffer<float, E> far(exec, std::size_t{streams} * (longest + 1));
  gart::parallel_for(
      exec, "windows", streams,
      fill_window<Capacity>{in.data(), in_lengths.data(), longest, kept.data(), sizes.data(), far.data()});
  auto const out = kept.to_host();
  auto const counts = sizes.to_host();
  auto const reach = far.to_host();
  long wrong = 0, wrong_far = 0;
  for (u32 i = 0; i < streams; ++i) {
    auto const begin = stream.begin() + i * longest;
    std::vector<hit> expected(begin, begin + lengths[i]);
    std::sort(expected.begin(), expected.end(), in_order);
    if (expected.size() > Capacity) expected.resize(Capacity);
    auto const kept_begin = out.begin() + i * Capacity;
    wrong += !same({kept_begin, kept_begin + std::min<u32>(counts[i], Capacity)}, expected);
    // What lies beyond the Capacity-th nearest so far cannot enter; before there are so many, anything can.
    std::vector<float> nearest;
    for (u32 k = 0; k <= lengths[i]; ++k) {
      if (k > 0) nearest.insert(std::upper_bound(nearest.begin(), nearest.end(), begin[k - 1].t), begin[k - 1].t);
      float const limit =
          nearest.size() < Capacity ? std::numeric_limits<float>::max() : nearest[std::size_t{Capacity} - 1];
      wrong_far += reach[i * (longest + 1) + k] != limit;
    }
  }
  CHECK(wrong == 0);
  CHECK(wrong_far == 0);
}

gart::ray along_z() { return {vec3(0.0f), vec3(0, 0, 1)}; }

}  // namespace

TEST_CASE_TEMPLATE("a window keeps the nearest, sorted, ties by id", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed());
  E exec;
  check_window<1>(exec, random);
  check_window<2>(exec, random);
  check_window<8>(exec, random);
  check_window<16>(exec, random);
}

TEST_CASE_TEMPLATE("10,000 hits on one ray", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed() + 1);
  std::uniform_real_distribution<float> depth(0.5f, 20.0f), beside(-0.02f, 0.02f);
  E exec;
  gart::gaussian_model model;
  for (int i = 0; i < 10000; ++i) add(model, {beside(random), beside(random), depth(random)}, 0.05f);
  check_rays(exec, model, {along_z(), {vec3(0, 0, 25), vec3(0, 0, -1)}}, 0.01f, 10000);
}

TEST_CASE_TEMPLATE("thousands of coincident Gaussians, and groups of them", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model model;
  SUBCASE("one place") {
    for (int i = 0; i < 4000; ++i) add(model, {0.01f, 0, 3}, 0.1f);
  }
  SUBCASE("groups of 1 to 40 at equal distance, interleaved") {
    for (int i = 0; i < 40; ++i) {
      float const x = 0.01f * static_cast<float>(i % 3);
      for (int k = i; k < 40; ++k) add(model, {x, 0, 1.0f + static_cast<float>(k)}, 0.1f);
    }
  }
  check_rays(exec, model, {along_z()}, 0.01f, model.size());
}

TEST_CASE_TEMPLATE("random scenes leave out hits behind the origin and too near", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed() + 2);
  std::uniform_real_distribution<float> at(-3, 3), size(-3, 0);
  std::normal_distribution<float> normal;
  E exec;
  gart::gaussian_model model;
  for (int i = 0; i < 3000; ++i) add(model, {at(random), at(random), at(random)}, std::exp(size(random)), at(random));
  std::vector<gart::ray> rays;
  for (int i = 0; i < 30; ++i) {
    vec3 const d(normal(random), normal(random), normal(random));
    rays.push_back({vec3(at(random), at(random), at(random)), d / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z)});
  }
  check_rays(exec, model, rays, 0.3f, 0);
  // A hit at exactly the near distance is none.
  gart::gaussian_model two;
  add(two, {0, 0, 0.5f}, 0.125f);
  add(two, {0, 0, 0.75f}, 0.125f);
  check_rays(exec, two, {along_z()}, 0.5f, 1);
}

// Boxes prune and nothing else: what the exact test would hit is met, at any size, place and thinness.
TEST_CASE_TEMPLATE("Gaussians of every size and place are met as without a tree", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  std::mt19937_64 random(gart_test::seed() + 3);
  std::uniform_real_distribution<float> unit(-1, 1);
  auto const point = [&](float reach) { return reach * vec3(unit(random), unit(random), unit(random)); };
  float sizes = 39, places = 1;
  SUBCASE("around the frame") {}
  SUBCASE("to 1e7") { places = 1e7f; }
  SUBCASE("of one size, to 1e7") { sizes = 2, places = 1e7f; }
  E exec;
  gart::gaussian_model model;
  for (int i = 0; i < 600; ++i) {
    add(model, point(i % 2 ? places : 3.0f), 1.0f, 5 * unit(random));
    for (int k = 0; k < 3; ++k) model.log_scale[3 * i + k] = sizes * unit(random);
    for (int k = 0; k < 4; ++k) model.quaternion[4 * i + k] = unit(random);
  }
  // What is never hit, as far out as floats go.
  add(model, vec3(1e30f, 0, 0), 1.0f);
  add(model, vec3(-3e38f), 1.0f);
  std::vector<gart::ray> rays;
  for (int i = 0; i < 60; ++i) {
    float const* const mean = &model.mean[3 * (random() % 600)];
    vec3 const origin = i % 3 ? point(i % 2 ? places : 3.0f) : vec3(0.0f);
    vec3 const d = vec3(mean[0], mean[1], mean[2]) - origin;
    float const length = std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z);
    if (length > 0) rays.push_back({origin, d / length});
  }
  check_rays(exec, model, rays, 0.01f, 0);
}
