// Footprints against every pixel's ray, evaluated with the functions that decide a hit when rendering: no hit lies
// outside its box or nearer than its depth, and boxes are not much larger than their hits demand.
#include <tiles/ellipsoids.hpp>

#include <gart/render/pixels.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <sstream>

using gart_test::placement;

namespace {

constexpr float alpha_min = 1.0f / 255;
constexpr int cameras_per_placement = 100;
constexpr int ellipsoids_per_camera = 72;  // 100,800 in all

struct rays {
  std::vector<gart::primary_ray> primary;
  std::vector<double> depth;  // over distance, as the camera measures it

  explicit rays(gart::camera const& c) {
    gart::ray_depth const along = gart::visit_camera(c, [](auto const& model) { return model.depth(); });
    for (int y = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x) {
        primary.push_back(gart::pixel_ray(c, {x, y}));
        gart::vec3d const d(primary.back().direction), axis(along.axis);
        depth.push_back(d.x * axis.x + d.y * axis.y + d.z * axis.z + along.offset);
      }
  }
};

struct tally {
  long gaussians = 0, hit = 0, outside = 0, too_near = 0;
  double box_area = 0, bounds_area = 0, missed_area = 0;  // of boxes with hits, of their hits' bounds, of boxes without
  // Boxes not cut by the image or the near plane, and those of them a side of which is over 2 pixels out.
  long inner = 0, loose = 0;
  std::string first;

  void measure(gart::camera const& c, float near, rays const& r, gart::gaussian_parameters const& g,
               gart::footprint const& f) {
    gart::ray_gaussian const record = gart::prepare(g, c.position, alpha_min);
    int x0 = c.width, y0 = c.height, x1 = 0, y1 = 0;
    long out = 0, nearer = 0;
    for (int y = 0, i = 0; y < c.height; ++y)
      for (int x = 0; x < c.width; ++x, ++i) {
        gart::ray_peak const e = gart::evaluate(record, r.primary[i]);
        if (!gart::is_hit(record, e, near)) continue;
        x0 = std::min(x0, x), x1 = std::max(x1, x + 1), y0 = std::min(y0, y), y1 = std::max(y1, y + 1);
        out += x < f.box.x0 || x >= f.box.x1 || y < f.box.y0 || y >= f.box.y1;
        nearer += e.t * r.depth[i] < f.depth;
      }
    ++gaussians, outside += out > 0, too_near += nearer > 0;
    if ((out || nearer) && first.empty()) describe(c, near, g, f, {x0, y0, x1, y1}, out, nearer);
    if (x1 == 0) {
      missed_area += f.box.area();
      return;
    }
    ++hit;
    box_area += f.box.area(), bounds_area += double(x1 - x0) * (y1 - y0);
    if (f.box.x0 > 0 && f.box.y0 > 0 && f.box.x1 < c.width && f.box.y1 < c.height && f.depth > near)
      ++inner, loose += std::max({x0 - f.box.x0, y0 - f.box.y0, f.box.x1 - x1, f.box.y1 - y1}) > 2;
  }

 private:
  void describe(gart::camera const& c, float near, gart::gaussian_parameters const& g, gart::footprint const& f,
                std::vector<int> const& hits, long out, long nearer) {
    std::ostringstream s;
    s.precision(9);
    s << out << " hits outside, " << nearer << " too near; box " << f.box.x0 << ".." << f.box.x1 << " x " << f.box.y0
      << ".." << f.box.y1 << " depth " << f.depth << "; hits " << hits[0] << ".." << hits[2] << " x " << hits[1] << ".."
      << hits[3] << "; mean " << g.mean.x << ' ' << g.mean.y << ' ' << g.mean.z << " log_scale " << g.log_scale.x << ' '
      << g.log_scale.y << ' ' << g.log_scale.z << " q " << g.rotation.w << ' ' << g.rotation.x << ' ' << g.rotation.y
      << ' ' << g.rotation.z << " logit " << g.opacity << "; camera " << c.width << 'x' << c.height << " f " << c.fx
      << ' ' << c.fy << " c " << c.cx << ' ' << c.cy << " near " << near;
    gart::vec3d const d = gart::vec3d(g.mean) - c.position;
    gart::mat3d const r(c.rotation);
    for (int k = 0; k < 3; ++k) s << ' ' << "xyz"[k] << ' ' << r[k].x * d.x + r[k].y * d.y + r[k].z * d.z;
    first = s.str();
  }
};

tally measure(placement p) {
  gart_test::ellipsoid_source source(gart_test::seed() + 7919 * static_cast<std::uint64_t>(p));
  tally all;
  for (int k = 0; k < cameras_per_placement; ++k) {
    gart::camera const c = source.camera(p);
    float const near = source.near_distance(p);
    rays const r(c);
    gart::visit_camera(c, [&](auto const& model) {
      auto const bounds = model.bounds(near);
      for (int i = 0; i < ellipsoids_per_camera; ++i) {
        gart::gaussian_parameters const g = source.gaussian(p, c);
        all.measure(c, near, r, g, gart::footprint_of(bounds, g, c.position, alpha_min));
      }
    });
  }
  return all;
}

}  // namespace

TEST_CASE("no hit lies outside its box or nearer than its depth") {
  CAPTURE(gart_test::seed());
  // How much larger in the mean: the area of boxes with hits against that of their hits' bounds, and the area of boxes
  // without hits, in pixels a Gaussian (images have about 2,800). Hits lie where the response is largest, not
  // everywhere on the ellipsoid, so an ellipsoid about the camera has a larger box than its hits.
  struct {
    placement where;
    double ratio, missed;
  } const limits[] = {{placement::ordinary, 1.1, 1},
                      {placement::across_near_plane, 1.6, 200},
                      {placement::around_camera, 1.6, 1300},
                      {placement::behind, 3, 170},
                      {placement::pancake, 1.9, 300},
                      {placement::sub_pixel, 1.6, 0.1},
                      {placement::whole_screen, 1.1, 1},
                      {placement::far_away, 1.25, 1},
                      {placement::far_from_origin, 1.1, 1},
                      {placement::tiny_near, 1.6, 500},
                      {placement::lens, 1.4, 60}};
  for (int k = 0; k < static_cast<int>(placement::count); ++k) {
    placement const where = static_cast<placement>(k);
    tally const t = measure(where);
    INFO(std::string(gart_test::name_of(where)), ": ", t.hit, " of ", t.gaussians, " hit; ", t.first);
    CHECK(t.outside == 0);
    CHECK(t.too_near == 0);
    CHECK(t.hit > 50);
    double const ratio = t.box_area / t.bounds_area, missed = t.missed_area / static_cast<double>(t.gaussians);
    CAPTURE(ratio);
    CAPTURE(missed);
    for (auto const& limit : limits)
      if (limit.where == where) {
        CHECK(ratio < limit.ratio);
        CHECK(missed < limit.missed);
      }
    // A thin ellipse may pass between pixel centres, so not quite all.
    if (where == placement::ordinary || where == placement::far_away || where == placement::far_from_origin) {
      CHECK(t.inner > 300);
      CHECK(t.loose * 100 < t.inner);
    }
  }
}
