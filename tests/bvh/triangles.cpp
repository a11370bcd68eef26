// Triangles under the tree, against all of them one by one in double; and that nothing slips through where they meet.
#include <gart/bvh/triangle.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

namespace {

using gart::triangle;
using gart::u32;
using gart::vec3;
using gart::vec3d;

struct trace_triangles {
  gart::triangles_view in;
  gart::ray const* rays;
  float near, far;
  gart::triangle_hit* nearest;
  u32* any;
  GART_KERNEL void operator()(gart::index_t i) const {
    nearest[i] = gart::nearest_triangle(in, rays[i], near, far);
    any[i] = gart::meets_any_triangle(in, rays[i], near, far);
  }
};

struct answers {
  std::vector<gart::triangle_hit> nearest;
  std::vector<u32> any;
};

template <class E>
answers trace(E& exec, std::vector<triangle> const& all, std::vector<gart::ray> const& rays, float near = 0,
              float far = gart::infinity) {
  std::vector<gart::box> boxes;
  for (triangle const& t : all) boxes.push_back(gart::triangle_box(t));
  gart::buffer<triangle, E> const triangles(exec, all);
  gart::buffer<gart::box, E> const there(exec, boxes);
  gart::buffer<gart::ray, E> const of(exec, rays);
  gart::buffer<gart::triangle_hit, E> nearest(exec, rays.size());
  gart::buffer<u32, E> any(exec, rays.size());
  gart::bvh<E> tree(exec);
  tree.build(exec, there);
  parallel_for(exec, "triangles", static_cast<gart::index_t>(rays.size()),
               trace_triangles{{tree.view(), triangles.data()}, of.data(), near, far, nearest.data(), any.data()});
  return {nearest.to_host(), any.to_host()};
}

// Moeller and Trumbore, in double: the distance, and how far within the triangle, in parts of it.
struct double_hit {
  double t = HUGE_VAL, inside = -1;
};
double_hit meet(triangle const& t, gart::ray const& r) {
  vec3d const a(t.corner[0]), e(vec3d(t.corner[1]) - a), f(vec3d(t.corner[2]) - a), d(r.direction),
      o(vec3d(r.origin) - a);
  vec3d const p = glm::cross(d, f), q = glm::cross(o, e);
  double const det = glm::dot(e, p);
  if (det == 0) return {};
  double const u = glm::dot(o, p) / det, v = glm::dot(d, q) / det;
  return {glm::dot(f, q) / det, std::min({u, v, 1 - u - v})};
}

class random_triangles {
 public:
  explicit random_triangles(std::uint64_t seed) : engine_(seed) {}
  float normal() { return normal_(engine_); }
  vec3 point() { return {normal(), normal(), normal()}; }
  triangle any() {
    vec3 const at = 3.0f * point();
    float const size = std::exp(normal() - 1);
    return {{at + size * point(), at + size * point(), at + size * point()}};
  }
  gart::ray towards(vec3 const& target) {
    vec3 const o = 4.0f * point();
    return {o, glm::normalize(target - o)};
  }

 private:
  std::mt19937_64 engine_;
  std::normal_distribution<float> normal_;
};

}  // namespace

TEST_CASE_TEMPLATE("the nearest triangle is that of all in double", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  random_triangles random(seed);
  E exec;
  int met = 0;
  for (std::size_t const count : {1, 2, 9, 700}) {
    CAPTURE(count);
    std::vector<triangle> all(count);
    for (auto& t : all) t = random.any();
    std::vector<gart::ray> rays;
    for (int r = 0; r < 500; ++r) {
      triangle const& t = all[static_cast<std::size_t>(r) % count];
      rays.push_back(random.towards((t.corner[0] + t.corner[1] + t.corner[2]) / 3.0f + 0.2f * random.point()));
    }
    // With every third an axis: where two parts of a direction are zero.
    for (std::size_t r = 0; r < rays.size(); r += 3) {
      rays[r].direction = vec3(0.0f);
      rays[r].direction[static_cast<int>(r % 9 / 3)] = r % 2 ? 1.0f : -1.0f;
    }
    float const near = 0.5f, far = 9.0f;
    auto const got = trace(exec, all, rays, near, far);
    for (std::size_t r = 0; r < rays.size(); ++r) {
      CAPTURE(r);
      double nearest = far;
      u32 id = gart::triangle_hit::none;
      bool close = false;  // decided by a rounding
      for (u32 i = 0; i < all.size(); ++i) {
        auto const h = meet(all[i], rays[r]);
        close |= std::fabs(h.inside) < 1e-4 && h.t < nearest + 1e-4;
        close |= h.inside > -1e-4 && (std::fabs(h.t - double{near}) < 1e-4 || std::fabs(h.t - nearest) < 1e-4);
        if (h.inside >= 0 && h.t > double{near} && h.t < nearest) nearest = h.t, id = i;
      }
      if (close) continue;
      REQUIRE(got.nearest[r].id == id);
      CHECK(got.any[r] == (id != gart::triangle_hit::none));
      CHECK(got.nearest[r].t == doctest::Approx(nearest).epsilon(1e-4));
      if (id == gart::triangle_hit::none) continue;
      ++met;
      triangle const& t = all[id];
      float const u = got.nearest[r].u, v = got.nearest[r].v;
      vec3 const by_weights = (1 - u - v) * t.corner[0] + u * t.corner[1] + v * t.corner[2];
      vec3 const by_ray = rays[r].origin + got.nearest[r].t * rays[r].direction;
      CHECK(glm::length(by_weights - by_ray) < 2e-4f);
    }
  }
  CHECK(met > 100);
}

TEST_CASE_TEMPLATE("no ray slips through where triangles meet", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  random_triangles random(seed);
  E exec;
  // A sphere of triangles about the origin, seen from within: through corners, along edges and past them.
  int const rings = 24, sectors = 31;
  auto const corner = [&](int i, int j) {
    if (i == 0 || i == rings) return vec3(0, i ? -1.0f : 1.0f, 0);
    float const theta = 3.14159265f * static_cast<float>(i) / rings,
                phi = 6.2831853f * static_cast<float>(j % sectors) / sectors;
    return vec3(std::sin(theta) * std::cos(phi), std::cos(theta), std::sin(theta) * std::sin(phi));
  };
  vec3 const stretch(3.0f, 0.2f, 1.0f);
  std::vector<triangle> all;
  std::vector<gart::ray> rays;
  for (int i = 0; i < rings; ++i)
    for (int j = 0; j < sectors; ++j) {
      vec3 const a = stretch * corner(i, j), b = stretch * corner(i + 1, j), c = stretch * corner(i + 1, j + 1),
                 d = stretch * corner(i, j + 1);
      all.push_back({{a, b, c}}), all.push_back({{a, c, d}});
      vec3 const o = 0.05f * random.point() * stretch;
      float const along = std::fabs(random.normal()) / 4;
      for (vec3 const& to : {a, glm::mix(a, b, along), glm::mix(a, c, along), glm::mix(a, d, along)})
        if (glm::length(to - o) > 0) rays.push_back({o, glm::normalize(to - o)});
    }
  auto const got = trace(exec, all, rays);
  long lost = 0;
  for (std::size_t r = 0; r < rays.size(); ++r) lost += got.nearest[r].id == gart::triangle_hit::none || !got.any[r];
  CHECK(lost == 0);
}

TEST_CASE_TEMPLATE("triangles that are none are never met", E, GART_TEST_POLICIES) {
  E exec;
  float const nan = std::numeric_limits<float>::quiet_NaN(), inf = std::numeric_limits<float>::infinity();
  vec3 const a(-1, -1, 2), b(1, -1, 2), c(0, 1, 2);
  std::vector<triangle> all{{{a, a, a}},
                            {{a, b, 0.5f * (a + b)}},
                            {{a, b, vec3(nan, 0, 2)}},
                            {{a, b, vec3(0, inf, 2)}},
                            {{vec3(0, 0, -1), vec3(0, 0, 1), vec3(0, 0, 3)}}};
  std::vector<gart::ray> const rays{{vec3(0.0f), vec3(0, 0, 1)}, {vec3(0, -1, 0), vec3(0, 0, 1)}};
  auto const nothing = trace(exec, all, rays);
  for (auto const& h : nothing.nearest) CHECK(h.id == gart::triangle_hit::none);
  CHECK(nothing.any == std::vector<u32>{0, 0});
  // Twice the same one: the first is met.
  all.push_back({{a, b, c}}), all.push_back({{a, b, c}});
  auto const got = trace(exec, all, rays);
  CHECK(got.nearest[0].id == 5);
  CHECK(got.nearest[0].t == 2);
  CHECK(trace(exec, {}, rays).nearest[0].id == gart::triangle_hit::none);
}

TEST_CASE_TEMPLATE("layers and twins are told apart, whatever their order", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  // Sheets a few roundings behind each other, three of each.
  int const sheets = 64;
  auto const depth = [](double sheet) { return static_cast<float>(1 + sheet / 1048576); };
  std::vector<int> sheet_of;
  for (int i = 0; i < 3 * sheets; ++i) sheet_of.push_back(i / 3);
  std::mt19937_64 engine(seed);
  std::shuffle(sheet_of.begin(), sheet_of.end(), engine);
  std::vector<triangle> all;
  for (int const s : sheet_of) all.push_back({{{-3, -3, depth(s)}, {3, -3, depth(s)}, {0, 4, depth(s)}}});
  E exec;
  std::vector<gart::ray> const rays{{vec3(0.0f), vec3(0, 0, 1)}, {vec3(0.3f, -0.7f, 0), vec3(0, 0, 1)}};
  for (int s = 0; s < sheets; s += 5) {
    auto const first = std::find(sheet_of.begin(), sheet_of.end(), s) - sheet_of.begin();
    for (auto const& h : trace(exec, all, rays, depth(s - 0.5)).nearest) CHECK(h.id == static_cast<u32>(first));
  }
}

TEST_CASE_TEMPLATE("an edge that floats cannot tell from the ray", E, GART_TEST_POLICIES) {
  auto const seed = gart_test::seed();
  CAPTURE(seed);
  std::mt19937_64 engine(seed);
  // In whole numbers across a ray along z, whose products 64 bits hold: the edge b c passes by the ray at almost none.
  struct whole {
    std::int64_t x, y;
  };
  auto const cross = [](whole const& p, whole const& q) { return p.x * q.y - p.y * q.x; };
  auto const corner = [](whole const& p) { return vec3(static_cast<float>(p.x), static_cast<float>(p.y), 1); };
  E exec;
  int met = 0, missed = 0;
  for (int i = 0; i < 60; ++i) {
    std::int64_t const p = (1 << 22) + static_cast<std::int64_t>(engine() >> 42), q = p + i % 7 - 3;
    whole const a = i % 2 ? whole{-q, p} : whole{q, -p}, b{p, q}, c{1 - p, 1 - q};
    if (static_cast<float>(c.x * b.y) != static_cast<float>(c.y * b.x)) continue;
    std::int64_t const u = cross(c, b), v = cross(a, c), w = cross(b, a);
    bool const meets = (u >= 0 && v >= 0 && w >= 0) || (u <= 0 && v <= 0 && w <= 0);
    auto const got = trace(exec, {{{corner(a), corner(b), corner(c)}}}, {{vec3(0.0f), vec3(0, 0, 1)}});
    CHECK((got.nearest[0].id == 0) == meets);
    ++(meets ? met : missed);
  }
  CHECK(met > 10);
  CHECK(missed > 10);
}
