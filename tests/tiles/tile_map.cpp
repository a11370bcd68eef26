// Footprints, their places in the hit buffer and the tile-primitive map of whole scenes, on every policy, against one
// Gaussian at a time on the host.
#include <tiles/ellipsoids.hpp>

#include <gart/render/pixels.hpp>
#include <gart/tiles/tile_map.hpp>
#include <support/policies.hpp>

#include <algorithm>

using gart_test::placement;

namespace {

using gart::u32;
using gart::u64;

constexpr float alpha_min = 1.0f / 255;
constexpr u32 none = 0xffffffffu;

template <class T, class E>
std::vector<T> host_copy(E& exec, gart::span<T const> from) {
  std::vector<T> out(from.size());
  if (!out.empty()) exec.copy_out(out.data(), from.data(), out.size() * sizeof(T));
  return out;
}

bool same(gart::pixel_box const& a, gart::pixel_box const& b) {
  return a.x0 == b.x0 && a.y0 == b.y0 && a.x1 == b.x1 && a.y1 == b.y1;
}

template <class E, int Size>
struct pass {
  gart::footprints<E, Size> prints;
  gart::tile_map<E, Size> map;
  long left_out = 0;  // pairs of boxes and tiles that no list has
  explicit pass(E& exec) : prints(exec), map(exec) {}

  void check(E& exec, gart::gaussian_model const& model, gart::camera const& view, float near) {
    gart::gaussians<E> const scene(exec, model);
    prints.measure(exec, scene.view(), view, alpha_min, near);
    auto const ranges = host_copy(exec, prints.ranges());
    auto const depths = host_copy(exec, prints.depths());
    REQUIRE(ranges.size() == model.size());
    REQUIRE(depths.size() == model.size());
    check_boxes(model, view, near, ranges, depths);
    check_places(exec, ranges);
    gart::tile_grid<Size> const grid{view.width, view.height};
    check_number_order(exec, grid, ranges);
    check_depth_order(exec, model, view, near, ranges);
  }

 private:
  // Whether all of a grid of rays through a cell, and a pixel about it, pass by an ellipsoid that is wider by half of
  // itself and by a pixel, and lies in front of the camera. In double, by the distance of each ray.
  static bool clearly_missed(gart::camera const& view, gart::gaussian_parameters const& g,
                             gart::footprint_slots const& range, gart::pixel_box const& cell) {
    gart::pixel_box const tiles = gart::tiles_of<Size>(range);
    if (tiles.width() < 2 || tiles.height() < 2) return false;
    gart::mat3d const axes(gart::to_matrix(g.rotation));
    gart::vec3d const center = gart::vec3d(g.mean) - view.position;
    double const radius = std::sqrt(gart::hit_cutoff(g, alpha_min)), distance = glm::length(center);
    gart::vec3d half;
    for (int k = 0; k < 3; ++k) half[k] = 1.5 * radius * std::exp(double{g.log_scale[k]}) + distance / view.fx;
    if (glm::dot(center, gart::vec3d(view.rotation[2])) < 2 * std::max({half.x, half.y, half.z})) return false;
    for (double y = cell.y0 - 1.0; y <= cell.y1 + 1.0; y += 0.5)
      for (double x = cell.x0 - 1.0; x <= cell.x1 + 1.0; x += 0.5) {
        gart::vec3d const d(gart::ray_direction(view, static_cast<float>(x), static_cast<float>(y)));
        gart::vec3d o, v;
        for (int k = 0; k < 3; ++k) o[k] = -glm::dot(axes[k], center) / half[k], v[k] = glm::dot(axes[k], d) / half[k];
        gart::vec3d const c = glm::cross(o, v);
        if (glm::dot(c, c) <= glm::dot(v, v)) return false;
      }
    return true;
  }

  // A device may contract the double arithmetic and so move a bound that lies on a pixel's edge.
  static void check_boxes(gart::gaussian_model const& model, gart::camera const& view, float near,
                          std::vector<gart::footprint_slots> const& ranges, std::vector<float> const& depths) {
    u32 const n = static_cast<u32>(model.size());
    gart::gaussians_view<float const> const all{model.mean.data(),    model.log_scale.data(), model.quaternion.data(),
                                                model.opacity.data(), model.sh.data(),        n,
                                                model.sh_degree};
    std::size_t other = 0;
    for (u32 i = 0; i < n; ++i) {
      gart::footprint const f = gart::visit_camera(view, [&](auto const& model) {
        return gart::footprint_of(model.bounds(near), gart::load_parameters(all, i), view.position, alpha_min);
      });
      other += !same(f.box, ranges[i].box) || std::fabs(f.depth - depths[i]) > 1e-5f * std::fabs(f.depth);
    }
    CHECK(other <= (E::device ? model.size() / 200 : 0));
  }

  void check_places(E& exec, std::vector<gart::footprint_slots> const& ranges) const {
    auto const pair_offsets = host_copy(exec, prints.pair_offsets());
    u64 slots = 0, pairs = 0;
    long wrong = 0;
    for (std::size_t i = 0; i < ranges.size(); ++i) {
      wrong += ranges[i].offset != slots || pair_offsets[i] != pairs;
      slots += ranges[i].box.area();
      pairs += gart::tiles_of<Size>(ranges[i].box).area();
    }
    CHECK(wrong == 0);
    CHECK(prints.slots() == slots);
    CHECK(prints.pairs() == pairs);
  }

  // Whether the map holds each overlapping pair once, tile after tile, sorted by `key` of a primitive and its cell.
  template <class Key>
  void check_pairs(E& exec, gart::tile_grid<Size> const& grid, std::vector<gart::footprint_slots> const& ranges,
                   Key const& key) const {
    auto const offsets = host_copy(exec, map.view().offsets);
    auto const primitives = host_copy(exec, map.view().primitives);
    std::vector<u32> expected, starts{0};
    for (u32 t = 0; t < grid.count(); ++t) {
      gart::pixel_box const area = grid.tile(t);
      for (u32 i = 0; i < ranges.size(); ++i)
        if (!ranges[i].box.empty() && !gart::intersect(ranges[i].box, area).empty()) expected.push_back(i);
      std::stable_sort(expected.begin() + starts.back(), expected.end(),
                       [&](u32 a, u32 b) { return key(t, a) < key(t, b); });
      starts.push_back(static_cast<u32>(expected.size()));
    }
    CHECK(offsets == starts);
    CHECK(primitives == expected);
  }

  void check_number_order(E& exec, gart::tile_grid<Size> const& grid,
                          std::vector<gart::footprint_slots> const& ranges) {
    map.build(exec, grid, prints, gart::number_order{});
    check_pairs(exec, grid, ranges, [](u32, u32 i) { return i; });
  }

  // No pixel of a pair hits nearer than the pair's key says, nor nearer than the keys before it in its list.
  void check_depth_order(E& exec, gart::gaussian_model const& model, gart::camera const& view, float near,
                         std::vector<gart::footprint_slots> const& ranges) {
    gart::tile_grid<Size> const grid{view.width, view.height};
    u32 const n = static_cast<u32>(model.size());
    gart::gaussians_view<float const> const all{model.mean.data(),    model.log_scale.data(), model.quaternion.data(),
                                                model.opacity.data(), model.sh.data(),        n,
                                                model.sh_degree};
    gart::buffer<gart::ray_gaussian, E> records(exec);
    std::vector<gart::ray_gaussian> gaussians;
    for (u32 i = 0; i < n; ++i)
      gaussians.push_back(gart::prepare(gart::load_parameters(all, i), view.position, alpha_min));
    records.assign(gaussians);
    gart::camera_rays<E> rays(exec);
    rays.cast(exec, view);
    gart::depth_orders<E, Size> orders(exec);
    gart::visit_camera(view, [&](auto const& model) {
      auto const order = orders.of(exec, model, rays, prints.depths().data(), records.data());
      map.build(exec, grid, prints, order, orders.test_of(model, records.data()));
    });
    gart::ray_depth const depth = gart::visit_camera(view, [](auto const& model) { return model.depth(); });
    gart::tile_map_view const made = map.view();
    auto const offsets = host_copy(exec, made.offsets);
    auto const primitives = host_copy(exec, made.primitives);
    auto const keys = host_copy(exec, made.keys);
    gart::tile_map_view const on_host{{}, {}, {keys.data(), keys.size()}, made.order_bits, made.depth_shift};
    CHECK(made.depth_shift < 24);  // an exponent and some of the mantissa are left to order by
    CHECK(std::is_sorted(keys.begin(), keys.end()));
    REQUIRE(offsets.size() == grid.count() + 1);
    long hits = 0, pairs = 0, needless = 0;
    std::vector<u32> entry(n);
    for (u32 t = 0; t < grid.count(); ++t) {
      std::fill(entry.begin(), entry.end(), none);
      for (u32 k = offsets[t]; k < offsets[t + 1]; ++k) {
        u32 const i = primitives[k];
        CHECK(entry[i] == none);
        entry[i] = k;
        if (k > offsets[t] && keys[k] == keys[k - 1]) CHECK(primitives[k - 1] < i);
      }
      for (u32 i = 0; i < n; ++i) {
        gart::pixel_box const cell = gart::intersect(ranges[i].box, grid.tile(t));
        if (entry[i] != none && (t * n + i) % 7 == 0)
          needless += clearly_missed(view, gart::load_parameters(all, i), ranges[i], cell);
        if (ranges[i].box.empty() || cell.empty()) {
          CHECK(entry[i] == none);
          continue;
        }
        ++pairs;
        for (int y = cell.y0; y < cell.y1; ++y)
          for (int x = cell.x0; x < cell.x1; ++x) {
            gart::vec3 const d = gart::pixel_ray(view, {x, y}).direction;
            gart::ray_peak const r = gart::evaluate(gaussians[i], gart::primary_ray{d});
            if (!gart::is_hit(gaussians[i], r, near)) continue;
            ++hits;
            float const of_hit = r.t * depth.per_distance(d);
            if (entry[i] == none)
              FAIL_CHECK("a hit of Gaussian " << i << " at " << x << ", " << y << " whose pair was left out");
            else if (!(of_hit >= on_host.depth(entry[i])))
              FAIL_CHECK("a hit of Gaussian " << i << " at " << of_hit << " before " << on_host.depth(entry[i]));
          }
      }
    }
    CAPTURE(hits);
    CHECK(needless == 0);
    left_out += pairs - long{offsets.back()};
  }
};

template <class E, int Size>
void check_scenes(E& exec) {
  gart_test::ellipsoid_source source(gart_test::seed() + Size);
  pass<E, Size> reused(exec);  // from view to view, as a training run does
  for (int trial = 0; trial < 12; ++trial) {
    placement const where = static_cast<placement>(trial % static_cast<int>(placement::count));
    gart::camera const view = source.camera(trial == 11 ? placement::lens : where);
    CAPTURE(gart_test::name_of(where));
    CAPTURE(Size);
    gart::gaussian_model model;
    int const n = trial % 3 == 0 ? 1000 : 100 + 37 * trial;
    for (int i = 0; i < n; ++i) gart_test::append(model, source.gaussian(where, view));
    reused.check(exec, model, view, 0.01f);
  }
  CHECK(reused.left_out > 300);
  // Needles through a lens: pairs are left out on the planes of tiles, too.
  gart::camera const lens = source.camera(placement::lens);
  gart::gaussian_model needles;
  for (int i = 0; i < 400; ++i) gart_test::append(needles, source.gaussian(placement::needle, lens));
  reused.left_out = 0;
  reused.check(exec, needles, lens, 0.01f);
  CHECK(reused.left_out > 50);
}

gart::gaussian_parameters at(double x, double y, double z, double scale) {
  float const s = static_cast<float>(std::log(scale));
  return {gart::vec3(x, y, z), gart::vec3(s), {1, 0, 0, 0}, 2.0f};
}

gart::camera straight(int width, int height) {
  gart::camera c;
  c.width = width, c.height = height;
  c.fx = c.fy = 20;
  c.cx = width * 0.5f, c.cy = height * 0.5f;
  return c;
}

}  // namespace

TEST_CASE_TEMPLATE("footprints, addresses and tile lists of random scenes", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  E exec;
  check_scenes<E, 4>(exec);
  check_scenes<E, 8>(exec);
  check_scenes<E, 16>(exec);
}

TEST_CASE_TEMPLATE("footprints and tile lists of scenes at the edges", E, GART_TEST_POLICIES) {
  E exec;
  pass<E, 8> p(exec);
  gart::gaussian_model model;
  SUBCASE("no Gaussians") {}
  SUBCASE("one") { gart_test::append(model, at(0, 0, 2, 0.1)); }
  SUBCASE("one that nothing sees") { gart_test::append(model, at(0, 0, -20, 0.1)); }
  SUBCASE("too weak, or not finite") {
    auto g = at(0, 0, 2, 0.1);
    g.opacity = -7;
    gart_test::append(model, g);
    g.opacity = NAN;
    gart_test::append(model, g);
    g = at(INFINITY, 0, 2, 0.1);
    gart_test::append(model, g);
    g = at(0, 0, 2, 0.1);
    g.rotation = {0, 0, 0, 0};
    gart_test::append(model, g);
  }
  SUBCASE("hidden ones between seen ones") {
    for (int i = 0; i < 300; ++i) gart_test::append(model, at(0.01 * i - 1.5, 0, i % 3 ? 2 : -20, 0.1));
  }
  SUBCASE("all over the screen") {
    for (int i = 0; i < 300; ++i) gart_test::append(model, at(0, 0, 2, 50));
  }
  p.check(exec, model, straight(61, 45), 0.01f);
  p.check(exec, model, straight(1, 1), 0.01f);
  p.check(exec, model, straight(8, 8), 0.01f);
  p.check(exec, model, straight(3, 200), 0.01f);
}

TEST_CASE_TEMPLATE("what can never be hit has an empty box", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussian_model model;
  auto weak = at(0, 0, 2, 0.1), lost = at(0, 0, 2, 0.1);
  weak.opacity = -7, lost.mean.x = NAN;
  for (auto const& g : {weak, lost, at(0, 0, -20, 0.1), at(50, 0, 2, 0.1)}) gart_test::append(model, g);
  gart::gaussians<E> const scene(exec, model);
  gart::footprints<E, 8> prints(exec);
  prints.measure(exec, scene.view(), straight(64, 48), alpha_min, 0.01f);
  CHECK(prints.slots() == 0);
  CHECK(prints.pairs() == 0);
}
