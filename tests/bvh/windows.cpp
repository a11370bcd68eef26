// The window of nearest hits, and rays with more hits than a window holds: resumed, nothing is lost or doubled.
#include <gart/render/frame.hpp>
#include <gart/trace/bvh_tracer.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <limits>
#include <random>

namespace {

using gart::hit;
using gart::u32;
using gart::vec3;

bool in_order(hit const& a, hit const& b) { return gart::before(a.t, a.id, b.t, b.id); }
bool same(hit const& a, hit const& b) { return a.t == b.t && a.id == b.id && a.alpha == b.alpha; }
bool same(std::vector<hit> const& a, std::vector<hit> const& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](hit const& x, hit const& y) { return same(x, y); });
}

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

// Ray i is rays[i]; its hits go to list[i][most], up to `wanted` of them.
struct collect : gart::ray_program_base {
  using ray_type = gart::ray;
  struct state {
    u32 ray, count;
  };
  gart::ray const* rays;
  hit* list;
  u32* counts;
  u32 number, most, wanted;
  GART_HD bool active(gart::index_t i) const { return i < number; }
  GART_HD state begin(gart::index_t i) const { return {i, 0}; }
  GART_HD gart::ray ray_of(gart::index_t i, state const&) const { return rays[i]; }
  GART_HD bool on_hit(state& s, hit const& h) const {
    if (s.count < most) list[static_cast<std::size_t>(s.ray) * most + s.count] = h;
    return ++s.count < wanted;
  }
  GART_HD void end(gart::index_t i, state const& s) const { counts[i] = s.count; }
};

// Every Gaussian as candidate: the windows without a tree.
template <int Capacity>
struct brute_windows {
  gart::traced_scene scene;
  collect program;
  GART_KERNEL void operator()(gart::index_t i) const {
    gart::trace_windows<Capacity>(scene, program, i, [this](auto const&, auto& visitor) {
      for (u32 k = 0; k < scene.count; ++k) visitor.leaf(k);
    });
  }
};

// One evaluation each, without windows.
struct evaluate_all {
  gart::traced_scene scene;
  gart::ray ray;
  hit* hits;  // t = -1: no hit
  GART_KERNEL void operator()(gart::index_t k) const {
    gart::ray_gaussian const g = scene.gaussians[k];
    gart::ray_peak const r = gart::evaluate(g, ray);
    hits[k] = {gart::is_hit(g, r, scene.near) ? r.t : -1.0f, k, gart::hit_alpha(g, r.d2)};
  }
};

void add(gart::gaussian_model& m, vec3 at, float scale, float opacity = 0.0f) {
  for (int k = 0; k < 3; ++k) m.mean.push_back(at[k]), m.log_scale.push_back(std::log(scale)), m.sh.push_back(0);
  for (float q : {1.0f, 0.0f, 0.0f, 0.0f}) m.quaternion.push_back(q);
  m.opacity.push_back(opacity);
}

template <class E>
void check_rays(E& exec, gart::gaussian_model const& model, std::vector<gart::ray> const& rays, float near,
                std::size_t least_hits) {
  gart::gaussians<E> const scene(exec, model);
  u32 const n = scene.size(), number = static_cast<u32>(rays.size());
  gart::camera at_origin;
  at_origin.width = at_origin.height = 1, at_origin.fx = at_origin.fy = 1;
  gart::render_options options;
  options.near = near;
  gart::frame<E, gart::scene_traits<0>, gart::bvh_tracer<E>> frame(exec);
  frame.prepare(scene.view(), at_origin, options);
  gart::traced_scene const traced{frame.gaussians().data(), n, near};
  gart::buffer<gart::ray, E> in(exec, rays);
  gart::buffer<hit, E> list(exec, std::size_t{number} * n), single(exec, n);
  gart::buffer<u32, E> counts(exec, number);

  std::vector<std::vector<hit>> expected;
  for (gart::ray const& r : rays) {
    gart::parallel_for(exec, "evaluate", n, evaluate_all{traced, r, single.data()});
    expected.emplace_back();
    for (hit const& h : single.to_host())
      if (h.t > near) expected.back().push_back(h);
    std::sort(expected.back().begin(), expected.back().end(), in_order);
    CHECK(expected.back().size() >= least_hits);
  }
  auto const compare = [&](char const* what, u32 wanted) {
    auto const flat = list.to_host();
    auto const found = counts.to_host();
    CAPTURE(what);
    CAPTURE(wanted);
    for (u32 i = 0; i < number; ++i) {
      auto want = expected[i];
      if (want.size() > wanted) want.resize(wanted);
      REQUIRE(found[i] == want.size());
      CHECK(same({flat.begin() + std::size_t{i} * n, flat.begin() + std::size_t{i} * n + found[i]}, want));
    }
  };
  for (u32 wanted : {0xffffffffu, 16u, 17u, 1u}) {
    collect const program{{}, in.data(), list.data(), counts.data(), number, n, wanted};
    frame.trace("bvh", number, program);
    compare("bvh", wanted);
    gart::parallel_for(exec, "brute", number, brute_windows<16>{traced, program});
    compare("window of 16", wanted);
  }
  gart::parallel_for(exec, "brute", number,
                     brute_windows<1>{traced, {{}, in.data(), list.data(), counts.data(), number, n, 40}});
  compare("window of 1", 40);
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

TEST_CASE_TEMPLATE("random scenes, hits behind the origin and at the near distance left out", E, GART_TEST_POLICIES) {
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
