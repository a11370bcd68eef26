// The OptiX tracer against the tile lists and the tree: the same hits and images, bit for bit. OptiX checks all that it
// is given and prints what it finds.
#include <oracle/scenes.hpp>
#include <rays/view_rays.hpp>
#include <support/trace_scene.hpp>

#include <gart/trace/optix_tracer.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace gart_test {

using policy = gart::cuda_exec;
using by_optix = gart::optix_tracer<policy>;
using by_tree = gart::bvh_tracer<policy>;
using by_tiles = gart::tile_tracer<policy>;

// Before OptiX starts.
bool const validated = setenv("GART_OPTIX_VALIDATE", "1", 0) == 0;

// False, with a line, where the driver has no OptiX.
bool optix_is_there() {
  std::string reason;
  bool const there = gart::optix_available(&reason);
  if (!there) std::printf("skipped: %s\n", reason.c_str());
  return there;
}

// What a list lacks of another, or has twice.
std::string difference(std::vector<gart::hit> const& got, std::vector<gart::hit> const& expected) {
  auto const in = [](std::vector<gart::hit> const& list, gart::u32 id) {
    return std::count_if(list.begin(), list.end(), [id](gart::hit const& h) { return h.id == id; });
  };
  for (gart::hit const& h : expected)
    if (in(got, h.id) == 0)
      return "lacks Gaussian " + std::to_string(h.id) + " at " + std::to_string(h.t) + ", alpha " +
             std::to_string(h.alpha);
  for (gart::hit const& h : got)
    if (in(got, h.id) != in(expected, h.id)) return "has Gaussian " + std::to_string(h.id) + " too often";
  return "another order or other bits";
}

bool same(std::vector<gart::hit> const& a, std::vector<gart::hit> const& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](gart::hit const& one, gart::hit const& other) {
    return one.id == other.id && std::memcmp(&one.t, &other.t, sizeof one.t) == 0 &&
           std::memcmp(&one.alpha, &other.alpha, sizeof one.alpha) == 0;
  });
}

void check_same(view_picture const& a, view_picture const& b) {
  CHECK(a.color == b.color);
  CHECK(a.transmittance == b.transmittance);
  CHECK(a.depth == b.depth);
  CHECK(a.hits == b.hits);
}

// Lengths times `factor`, so that nothing but exponents changes.
void scale(gart::gaussian_model& model, gart::camera& view, float factor) {
  for (float& x : model.mean) x *= factor;
  for (float& x : model.log_scale) x += std::log(factor);
  view.position *= double{factor};
}

gart::gaussian_model moved(gart::gaussian_model model, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal(0, 0.3f);
  for (float& x : model.mean) x += normal(random);
  for (float& x : model.log_scale) x += normal(random);
  return model;
}

template <class Tracer>
struct traced_view {
  policy& exec;
  gart::frame<policy, gart::scene_traits<3>, Tracer> frame;
  explicit traced_view(policy& e) : exec(e), frame(e) {}
  std::vector<float> operator()(gart::gaussian_model const& model, gart::camera const& view,
                                gart::render_options const& options) {
    gart::gaussians<policy> const scene(exec, gart::with_sh_degree(model, 3));
    gart::buffer<float, policy> color(exec, std::size_t{3} * view.width * view.height);
    frame.prepare(scene.view(), view, options);
    frame.render({color.data()});
    return color.to_host();
  }
};

TEST_CASE("OptiX gives the hit lists of tile lists") {
  if (!optix_is_there()) return;
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  policy exec;
  std::size_t hits = 0;
  for (auto const& s : oracle::scenes(seed)) {
    CAPTURE(s.name);
    auto options = s.options;
    options.transmittance_min = 0;
    auto const expected = hit_lists_by<by_tiles>(exec, s.model, s.view, options);
    auto const got = hit_lists_by<by_optix>(exec, s.model, s.view, options);
    REQUIRE(got.size() == expected.size());
    std::size_t different = 0;
    for (std::size_t i = 0; i < got.size(); ++i) {
      hits += got[i].size();
      if (same(got[i], expected[i])) continue;
      if (different++ == 0)
        std::printf("%s, pixel %zu: %s\n", s.name.c_str(), i, difference(got[i], expected[i]).c_str());
    }
    CHECK(different == 0);
  }
  CHECK(hits > 10000);
}

TEST_CASE("OptiX gives the image of the tree in every scene") {
  if (!optix_is_there()) return;
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  policy exec;
  for (auto const& s : oracle::scenes(seed)) {
    CAPTURE(s.name);
    check_same(trace_view<by_optix>(exec, s.model, s.view, s.options, s.active_degree),
               trace_view<by_tree>(exec, s.model, s.view, s.options, s.active_degree));
  }
}

TEST_CASE("OptiX gives the image of the tree through every lens") {
  if (!optix_is_there()) return;
  policy exec;
  auto const s = oracle::scenes(7).front();
  for (auto const kind :
       {gart::camera_kind::fisheye, gart::camera_kind::equirectangular, gart::camera_kind::orthographic}) {
    CAPTURE(static_cast<int>(kind));
    gart::camera view = s.view;
    view.kind = kind;
    if (kind == gart::camera_kind::orthographic) view.fx = view.fy = 8;
    if (kind == gart::camera_kind::equirectangular) view.width = 64, view.height = 32;
    check_same(trace_view<by_optix>(exec, s.model, view, s.options, 3),
               trace_view<by_tree>(exec, s.model, view, s.options, 3));
  }
  gart::camera rolling = s.view;
  rolling.shutter = gart::shutter_kind::top_to_bottom, rolling.travel = {0.4f, -0.2f, 0.3f};
  rolling.turn = {0.05f, 0.1f, -0.02f};
  check_same(trace_view<by_optix>(exec, s.model, rolling, s.options, 3),
             trace_view<by_tree>(exec, s.model, rolling, s.options, 3));
}

TEST_CASE("OptiX gives the image of the tree at extremes") {
  if (!optix_is_there()) return;
  policy exec;
  float const nan = std::nanf("");
  for (auto s : oracle::scenes(11)) {
    if (s.name != "cloud" && s.name != "needles" && s.name != "pancakes") continue;
    CAPTURE(s.name);
    // Some that are never hit, and some that are no Gaussians.
    for (std::size_t i = 0; i < s.model.size(); i += 7) {
      if (i % 5 == 0) s.model.opacity[i] = -30;
      if (i % 5 == 1) s.model.mean[3 * i] = nan;
      if (i % 5 == 2) s.model.log_scale[3 * i + 1] = nan;
      if (i % 5 == 3)
        for (std::size_t k = 0; k < 4; ++k) s.model.quaternion[4 * i + k] = 0;
      if (i % 5 == 4) s.model.log_scale[3 * i] = -30;
    }
    for (float const factor : {0x1p-30f, 0x1p-12f, 1.0f, 0x1p12f, 0x1p30f}) {
      CAPTURE(factor);
      auto model = s.model;
      auto view = s.view;
      scale(model, view, factor);
      auto options = s.options;
      options.near *= factor;
      check_same(trace_view<by_optix>(exec, model, view, options, s.active_degree),
                 trace_view<by_tree>(exec, model, view, options, s.active_degree));
    }
  }
}

TEST_CASE("OptiX refits its tree after Gaussians have moved") {
  if (!optix_is_there()) return;
  policy exec;
  auto const s = oracle::scenes(13).front();
  auto options = s.options;
  options.rebuild_every = 4;
  traced_view<by_optix> optix(exec);
  traced_view<by_tree> tree(exec);
  gart::gaussian_model model = s.model;
  gart::camera view = s.view;
  for (int step = 0; step < 11; ++step) {
    CAPTURE(step);
    CHECK(optix(model, view, options) == tree(model, view, options));
    model = moved(model, static_cast<std::uint64_t>(step));
    view.position.x += 0.05;
    if (step == 6) model = gart::with_sh_degree(oracle::scenes(17).back().model, 3);  // another number of Gaussians
  }
}

TEST_CASE("OptiX takes many rays and candidates in chunks") {
  if (!optix_is_there()) return;
  policy exec;
  for (auto s : oracle::scenes(19)) {
    bool const many_rays = s.name == "cloud", many_candidates = s.name == "thousands on a ray";
    if (!many_rays && !many_candidates) continue;
    CAPTURE(s.name);
    s.view = gart::resized(s.view, many_rays ? 1201 : 401, many_rays ? 903 : 301);
    check_same(trace_view<by_optix>(exec, s.model, s.view, s.options, s.active_degree),
               trace_view<by_tree>(exec, s.model, s.view, s.options, s.active_degree));
  }
}

// Rays from anywhere, as a program of its own.
struct free_rays : gart::ray_program_base {
  using ray_type = gart::ray;
  struct state {
    gart::u32 hits = 0;
    float sum = 0, transmittance = 1;
  };
  float const *origins, *directions;
  float* out;  // [rays][3]
  GART_HD bool active(gart::index_t) const { return true; }
  GART_HD state begin(gart::index_t) const { return {}; }
  GART_HD gart::ray ray_of(gart::index_t i, state const&) const {
    return {{origins[3 * i], origins[3 * i + 1], origins[3 * i + 2]},
            {directions[3 * i], directions[3 * i + 1], directions[3 * i + 2]}};
  }
  GART_HD bool on_hit(state& s, gart::hit const& h) const {
    ++s.hits, s.transmittance *= 1.0f - h.alpha, s.sum += s.transmittance * h.t * static_cast<float>(h.id % 97 + 1);
    return s.transmittance > 1e-4f;
  }
  GART_HD void end(gart::index_t i, state const& s) const {
    out[3 * i] = static_cast<float>(s.hits), out[3 * i + 1] = s.sum, out[3 * i + 2] = s.transmittance;
  }
};

template <class Tracer>
std::vector<float> trace_free(policy& exec, oracle::scene const& s, std::vector<float> const& o,
                              std::vector<float> const& d) {
  gart::gaussians<policy> const scene(exec, gart::with_sh_degree(s.model, 3));
  gart::frame<policy, gart::scene_traits<3>, Tracer> frame(exec);
  gart::buffer<float, policy> const origins(exec, o), directions(exec, d);
  gart::buffer<float, policy> out(exec, o.size());
  frame.prepare(scene.view(), s.view, s.options);
  frame.trace("free", static_cast<gart::index_t>(o.size() / 3),
              free_rays{{}, origins.data(), directions.data(), out.data()});
  return out.to_host();
}

TEST_CASE("OptiX gives the hits of the tree to rays from anywhere") {
  if (!optix_is_there()) return;
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  policy exec;
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  for (auto const& s : oracle::scenes(seed)) {
    if (s.name != "cloud" && s.name != "needles" && s.name != "pancakes") continue;
    CAPTURE(s.name);
    for (float const away : {0.5f, 50.0f, 5000.0f}) {
      CAPTURE(away);
      std::vector<float> o, d;
      for (int i = 0; i < 20000; ++i) {
        // From a point `away` from the scene to one in it, relative to the frame.
        gart::vec3 from, to;
        for (int k = 0; k < 3; ++k) {
          from[k] = away * normal(random) - static_cast<float>(s.view.position[k]);
          to[k] = normal(random) - static_cast<float>(s.view.position[k]);
        }
        gart::vec3 const way = to - from;
        float const length = std::sqrt(way.x * way.x + way.y * way.y + way.z * way.z);
        for (int k = 0; k < 3; ++k) o.push_back(from[k]), d.push_back(way[k] / length);
      }
      std::vector<float> const got = trace_free<by_optix>(exec, s, o, d), expected = trace_free<by_tree>(exec, s, o, d);
      std::size_t different = 0, hits = 0;
      for (std::size_t i = 0; i < got.size(); i += 3)
        different += std::memcmp(&got[i], &expected[i], 12) != 0, hits += static_cast<std::size_t>(got[i]);
      CHECK(different == 0);
      CHECK(hits > 1000);
    }
  }
}

TEST_CASE("OptiX refuses what it cannot trace, by name") {
  if (!optix_is_there()) return;
  policy exec;
  auto const message = [](auto&& body) {
    try {
      body();
    } catch (gart::error const& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  auto s = oracle::scenes(23).front();
  s.model.mean[0] = 3e15f;
  CHECK(message([&] { traced_view<by_optix>{exec}(s.model, s.view, s.options); }).find("reaches 1e15 units") !=
        std::string::npos);

  s = oracle::scenes(23).front();
  std::vector<float> const far{3e15f, 0, 0}, ahead{-1, 0, 0};
  CHECK(message([&] { trace_free<by_optix>(exec, s, far, ahead); }).find("ray begins 1e15 units") != std::string::npos);
  // A ray that is not finite has no hits.
  float const nan = std::nanf("");
  CHECK(trace_free<by_optix>(exec, s, {nan, 0, 0, 0, 0, 0}, {1, 0, 0, 0, nan, 0}) ==
        std::vector<float>{0, 0, 1, 0, 0, 1});

  gart::optix_scene tree(exec);
  gart::buffer<gart::box, policy> const boxes(exec, std::vector<gart::box>(3, {gart::vec3(-1.0f), gart::vec3(1.0f)}));
  tree.build(boxes, false);
  CHECK(message([&] { tree.refit(boxes); }).find("as many boxes") != std::string::npos);
  tree.build(boxes, true);
  CHECK(message([&] { tree.refit(boxes.view().subspan(0, 2)); }).find("as many boxes") != std::string::npos);
  tree.refit(boxes);

  // Each box once, and none behind a ray's end.
  std::vector<gart::optix_ray> const rays{{{-5, 0, 0}, 0, {1, 0, 0}, 100},
                                          {{-5, 0, 0}, 0, {1, 0, 0}, 2},
                                          {{-5, 0, 0}, 0, {1, 0, 0}, -1},
                                          {{-5, 2, 0}, 0, {1, 0, 0}, 100}};
  gart::buffer<gart::optix_ray, policy> const on_device(exec, rays);
  gart::buffer<gart::u32, policy> counts(exec, 4), ids(exec, 3);
  tree.count(on_device, counts);
  CHECK(counts.to_host() == std::vector<gart::u32>{3, 0, 0, 0});
  gart::buffer<gart::u64, policy> const offsets(exec, std::vector<gart::u64>{0, 3, 3, 3});
  tree.list(on_device, counts, offsets, ids);
  tree.require_same();
  auto listed = ids.to_host();
  std::sort(listed.begin(), listed.end());
  CHECK(listed == std::vector<gart::u32>{0, 1, 2});
  CHECK(message([&] { tree.count(on_device, counts.view().subspan(0, 3)); }).find("a count for each ray") !=
        std::string::npos);
  // Room for fewer than are met: found, never written beyond.
  counts.assign(std::vector<gart::u32>{2, 0, 0, 0});
  tree.list(on_device, counts, offsets, ids);
  CHECK(message([&] { tree.require_same(); }).find("of 1 rays") != std::string::npos);
  tree.require_same();
}

TEST_CASE("OptiX says its version") {
  if (!optix_is_there()) return;
  std::printf("OptiX %s on %s\n", gart::optix_scene::version(), gart::cuda_devices().front().name.c_str());
}

}  // namespace gart_test
