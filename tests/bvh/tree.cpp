// The tree over boxes: its shape and bounds after build and refit, and that a walk proposes what a ray crosses, once.
// The boxes of its nodes are rounded outward, at every size and place.
#include <gart/bvh/walk.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <numeric>
#include <random>

namespace {

using gart::box;
using gart::u32;
using gart::vec3;

struct counting_visitor {
  box const* boxes;
  gart::slab_ray ray;
  u32* visits;
  float from, to;
  GART_HD float near() const { return from; }
  GART_HD float far() const { return to; }
  // A walk may propose what the ray just misses, but nothing twice.
  GART_HD void leaf(u32 id) { visits[id] += visits[id] > 0 || gart::crosses(boxes[id], ray, from, to); }
};

struct count_visits {
  gart::bvh_view tree;
  box const* boxes;
  gart::ray const* rays;
  float from, to;
  u32* visits;  // [rays][boxes]
  GART_KERNEL void operator()(gart::index_t i) const {
    counting_visitor v{boxes, gart::slab_ray(rays[i]), visits + static_cast<std::size_t>(i) * tree.count, from, to};
    gart::walk(tree, rays[i], v);
  }
};

// Of a node's children, how many are entered later by enter_child than by cross_children: a walk would prune those
// behind such a child wrongly.
struct count_late {
  gart::bvh_node const* nodes;
  gart::index_t count;
  gart::ray const* rays;
  u32* late;  // [rays][nodes]
  GART_KERNEL void operator()(gart::index_t i) const {
    gart::bvh_node const& n = nodes[i % count];
    gart::slab_ray const slab(rays[i / count]);
    float entry[gart::bvh_width];
    u32 const crossed = gart::cross_children(gart::load_bounds(n), slab, 0, 1e9f, entry);
    for (int c = 0; c < gart::bvh_width; ++c) {
      if (!(crossed >> c & 1u)) continue;
      float room = 1e-6f * entry[c];
      for (int k = 0; k < 3; ++k)
        room = fmaxf(room,
                     fabsf(slab.inverse[k]) * (1e-4f * n.axis(k).step() + 2e-7f * fabsf(n.origin[k] - slab.origin[k])));
      late[i] += gart::enter_child(n, c, slab, 0) > entry[c] + room;
    }
  }
};

bool is_empty(box const& b) { return b.lo.x > b.hi.x; }
bool holds(box const& outer, box const& inner) {
  for (int k = 0; k < 3; ++k)
    if (!(outer.lo[k] <= inner.lo[k] && outer.hi[k] >= inner.hi[k])) return false;
  return true;
}

class random_boxes {
 public:
  explicit random_boxes(std::uint64_t seed) : random_(seed) {}
  float uniform(float lo, float hi) { return std::uniform_real_distribution<float>(lo, hi)(random_); }
  vec3 point(float reach) { return {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)}; }
  box any(float reach) {
    vec3 const c = point(reach), h(std::exp(uniform(-8, 1)), std::exp(uniform(-8, 1)), std::exp(uniform(-8, 1)));
    return {c - h, c + h};
  }
  std::vector<box> many(std::size_t n, float reach = 10) {
    std::vector<box> out(n);
    for (auto& b : out) b = any(reach);
    return out;
  }
  gart::ray towards(vec3 const& target) {
    vec3 const origin = point(15);
    vec3 d = target - origin;
    if (uniform(0, 1) < 0.2f) {
      d = vec3(0.0f);
      d[static_cast<int>(uniform(0, 2.99f))] = uniform(-1, 1) < 0 ? -1.0f : 1.0f;
    }
    return {origin, d / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z)};
  }

 private:
  std::mt19937_64 random_;
};

// By slabs in double: +1 the ray crosses the box within [from, to] with room to spare, -1 it misses, 0 too close to
// say.
int crosses(box const& b, gart::ray const& r, double from, double to) {
  if (is_empty(b)) return -1;
  bool inside = true;
  double entry[2] = {from, from}, exit[2] = {to, to};  // of the box made smaller and made larger
  for (int k = 0; k < 3; ++k) {
    double const o = r.origin[k], d = r.direction[k], lo = b.lo[k], hi = b.hi[k];
    double const room = 1e-6 * (std::fabs(o) + std::fabs(lo) + std::fabs(hi) + 1e-30);
    for (int larger = 0; larger < 2; ++larger) {
      double const low = lo + (larger ? -room : room), high = hi + (larger ? room : -room);
      if (low > high) {
        inside = false;
      } else if (std::fabs(d) < 1e-12) {
        if (o < low || o > high) larger ? exit[1] = -1e300 : exit[0] = -1e300;
      } else {
        double const a = (low - o) / d, c = (high - o) / d;
        entry[larger] = std::max(entry[larger], std::min(a, c));
        exit[larger] = std::min(exit[larger], std::max(a, c));
      }
    }
  }
  double const near_enough = 1e-6 * (1 + std::fabs(entry[1]));
  return inside && entry[0] + near_enough < exit[0] ? 1 : entry[1] > exit[1] + near_enough ? -1 : 0;
}

template <class E>
std::vector<gart::bvh_node> nodes_of(E& exec, gart::bvh<E> const& tree) {
  std::vector<gart::bvh_node> nodes(std::max<std::size_t>(tree.view().count, 2) - 1);
  exec.copy_out(nodes.data(), tree.view().nodes, nodes.size() * sizeof(gart::bvh_node));
  return nodes;
}

// Every box but the empty ones is one leaf and lies in the child boxes of all nodes above it, and no path is longer
// than a walk's stack. Returns the child boxes of the root, joined.
box check_tree(std::vector<gart::bvh_node> const& nodes, std::vector<box> const& boxes) {
  std::vector<int> leaves(boxes.size(), 0);
  long outside = 0;
  int deepest = 0;
  std::vector<box> above;
  auto const below = [&](auto const& self, u32 index) -> void {
    gart::bvh_node const& n = nodes[index];
    deepest = std::max(deepest, static_cast<int>(above.size()) + 1);
    REQUIRE(n.inner_count() + n.leaf_count() <= gart::bvh_width);
    REQUIRE((n.inner_mask() & n.leaf_mask()) == 0u);
    for (int c = 0; c < gart::bvh_width; ++c) {
      above.push_back(n.child_box(c));
      if (n.leaf_mask() >> c & 1u) {
        u32 const id = n.child[c];
        REQUIRE(id < boxes.size());
        ++leaves[id];
        for (box const& b : above) outside += !holds(b, boxes[id]);
      } else if (n.inner_mask() >> c & 1u) {
        REQUIRE(n.child[c] < nodes.size());
        REQUIRE(above.size() < 97);
        self(self, n.child[c]);
      }
      above.pop_back();
    }
  };
  below(below, 0);
  CHECK(outside == 0);
  CHECK(deepest <= 96);
  long wrong_leaves = 0;
  for (std::size_t i = 0; i < boxes.size(); ++i) wrong_leaves += leaves[i] != (is_empty(boxes[i]) ? 0 : 1);
  CHECK(wrong_leaves == 0);
  box all = gart::empty_box();
  for (int c = 0; c < gart::bvh_width; ++c)
    if ((nodes[0].inner_mask() | nodes[0].leaf_mask()) >> c & 1u) all = gart::join(all, nodes[0].child_box(c));
  return all;
}

template <class E>
void check_walk(E& exec, gart::bvh<E> const& tree, std::vector<box> const& boxes, std::vector<gart::ray> const& rays,
                float from, float to) {
  gart::buffer<box, E> boxes_on_device(exec, boxes);
  gart::buffer<gart::ray, E> on_device(exec, rays);
  gart::buffer<u32, E> visits(exec, rays.size() * boxes.size() + 1);
  visits.zero();
  gart::parallel_for(exec, "visits", static_cast<u32>(rays.size()),
                     count_visits{tree.view(), boxes_on_device.data(), on_device.data(), from, to, visits.data()});
  auto const seen = visits.to_host();
  long missed = 0, twice = 0, needless = 0;
  for (std::size_t i = 0; i < rays.size(); ++i)
    for (std::size_t k = 0; k < boxes.size(); ++k) {
      int const expected = crosses(boxes[k], rays[i], from, to);
      u32 const n = seen[i * boxes.size() + k];
      missed += expected > 0 && n == 0;
      twice += n > 1;
      needless += expected < 0 && n > 0;
    }
  CHECK(missed == 0);
  CHECK(twice == 0);
  CHECK(needless == 0);
}

template <class E>
void check_boxes(E& exec, random_boxes& source, std::vector<box> const& boxes) {
  std::size_t const n = boxes.size();
  CAPTURE(n);
  gart::buffer<box, E> on_device(exec, boxes);
  gart::bvh<E> tree(exec);
  tree.build(exec, on_device);
  CHECK(tree.view().count == n);
  if (n > 0) check_tree(nodes_of(exec, tree), boxes);
  std::vector<gart::ray> rays;
  for (int i = 0; i < 100; ++i) {
    vec3 target = source.point(10);
    if (n > 0) {
      box const& b = boxes[static_cast<std::size_t>(source.uniform(0, 0.999f) * n)];
      if (!is_empty(b)) target = 0.5f * b.lo + 0.5f * b.hi;
    }
    rays.push_back(source.towards(target));
  }
  check_walk(exec, tree, boxes, rays, 0, 1e9f);
  check_walk(exec, tree, boxes, rays, 5, 12);

  // Moved boxes: the same tree, and the bounds of one built anew.
  std::vector<box> moved = boxes;
  for (auto& b : moved) {
    vec3 const by = source.point(3);
    if (!is_empty(b)) b = {b.lo + by, b.hi + by};
  }
  on_device.assign(moved);
  tree.refit(exec, on_device);
  gart::bvh<E> anew(exec);
  anew.build(exec, on_device);
  if (n > 0) {
    box const refitted = check_tree(nodes_of(exec, tree), moved), built = check_tree(nodes_of(exec, anew), moved);
    // Different children of the root, of the same boxes.
    for (int k = 0; k < 3; ++k) {
      float const room = 0.01f * (built.hi[k] - built.lo[k]);
      CHECK((refitted.lo[k] == built.lo[k] || std::fabs(refitted.lo[k] - built.lo[k]) <= room));
      CHECK((refitted.hi[k] == built.hi[k] || std::fabs(refitted.hi[k] - built.hi[k]) <= room));
    }
  }
  check_walk(exec, tree, moved, rays, 0, 1e9f);
}

}  // namespace

TEST_CASE_TEMPLATE("a walk visits every box a ray crosses, once", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  random_boxes source(gart_test::seed());
  E exec;
  for (std::size_t n : {0, 1, 2, 3, 4, 5, 17, 100, 1000, 20000}) check_boxes(exec, source, source.many(n));
}

TEST_CASE_TEMPLATE("a walk prunes by the order it sorted by", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  random_boxes source(gart_test::seed());
  E exec;
  gart::buffer<box, E> boxes(exec, source.many(2000));
  gart::bvh<E> tree(exec);
  tree.build(exec, std::as_const(boxes).view());
  std::vector<gart::ray> rays;
  for (int i = 0; i < 100; ++i) rays.push_back(source.towards(source.point(10)));
  gart::buffer<gart::ray, E> on_device(exec, rays);
  auto const nodes = static_cast<gart::index_t>(tree.view().count / 8);  // of the upper ones
  gart::buffer<u32, E> late(exec, rays.size() * nodes);
  late.zero();
  gart::parallel_for(exec, "late", static_cast<u32>(late.size()),
                     count_late{tree.view().nodes, nodes, on_device.data(), late.data()});
  auto const all = late.to_host();
  CHECK(std::accumulate(all.begin(), all.end(), 0u) == 0);
}

TEST_CASE_TEMPLATE("boxes that share a centre, a code or nothing at all", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  random_boxes source(gart_test::seed() + 1);
  E exec;
  std::vector<box> boxes;
  SUBCASE("thousands of one box") { boxes.assign(5000, source.any(5)); }
  SUBCASE("two boxes, one of them twice") { boxes = {source.any(5), source.any(5)}, boxes.push_back(boxes[0]); }
  SUBCASE("thousands within one cell of the code, one far away") {
    boxes = source.many(5000, 1e-4f);
    boxes.push_back({vec3(9000.0f), vec3(9001.0f)});
  }
  SUBCASE("powers of two: the deepest tree") {
    for (int k = 0; k < 60; ++k) {
      vec3 const c(std::ldexp(1.0f, -k / 3), k % 3 ? std::ldexp(1.0f, -k / 2) : 0.0f, std::ldexp(1.0f, -k));
      boxes.insert(boxes.end(), 50, {c - vec3(0.01f), c + vec3(0.01f)});
    }
  }
  SUBCASE("points and flat boxes") {
    for (int i = 0; i < 500; ++i) {
      box b = source.any(5);
      b.hi[i % 3] = b.lo[i % 3];
      boxes.push_back(b);
    }
  }
  SUBCASE("empty ones among others") {
    boxes = source.many(1000);
    for (std::size_t i = 0; i < boxes.size(); i += 3) boxes[i] = gart::empty_box();
  }
  SUBCASE("all empty") { boxes.assign(100, gart::empty_box()); }
  SUBCASE("one, empty") { boxes.assign(1, gart::empty_box()); }
  check_boxes(exec, source, boxes);
}

TEST_CASE_TEMPLATE("boxes of every size and place", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  random_boxes source(gart_test::seed() + 2);
  E exec;
  std::vector<box> boxes;
  float const most = 3.402823466e38f, tiny = 1e-45f;
  SUBCASE("sizes from nothing to e^40, places to 1e7") {
    for (int i = 0; i < 3000; ++i) {
      vec3 const c = source.point(i % 3 ? 1e7f : 1.0f);
      vec3 h(0.0f);
      for (int k = 0; k < 3; ++k) h[k] = i % 5 == k ? 0.0f : std::exp(source.uniform(-40, 40));
      boxes.push_back({c - h, c + h});
    }
  }
  SUBCASE("small boxes far from the origin") {
    for (int i = 0; i < 3000; ++i) {
      vec3 const c = vec3(1e7f, -1e7f, 3e6f) + source.point(100);
      boxes.push_back({c - vec3(0.01f), c + vec3(0.01f)});
    }
  }
  SUBCASE("points, at one place, next to each other, around 0") {
    for (float x : {0.0f, -0.0f, tiny, -tiny, 1e-38f, -1e-38f, 1.0f, std::nextafter(1.0f, 2.0f), -1.0f})
      for (int i = 0; i < 20; ++i) boxes.push_back({vec3(x, i % 2 ? x : 0.0f, x), vec3(x, i % 2 ? x : 0.0f, x)});
  }
  SUBCASE("outliers to the largest float, among others") {
    boxes = source.many(500);
    for (float x : {1e30f, 8e37f, 9e37f, 2e38f, most}) {
      boxes.push_back({vec3(-x), vec3(x)});
      boxes.push_back({vec3(x, 0, 0), vec3(x, 1, 1)});
      boxes.push_back({vec3(-x, 0, 0), vec3(-x, 1, 1)});
    }
  }
  check_boxes(exec, source, boxes);
}

TEST_CASE_TEMPLATE("one box far away leaves the others their order", E, GART_TEST_POLICIES) {
  random_boxes random(gart_test::seed());
  CAPTURE(gart_test::seed());
  E exec;
  std::vector<box> boxes(4000);
  for (box& b : boxes) {
    vec3 const c = random.point(1);
    b = {c - vec3(0.01f), c + vec3(0.01f)};
  }
  // What a ray of the scene meets on its way to a leaf: the sizes of the inner boxes that are all in the scene.
  auto const sizes = [&](std::vector<box> const& all) {
    gart::buffer<box, E> on_device(exec, all);
    gart::bvh<E> tree(exec);
    tree.build(exec, std::as_const(on_device).view());
    auto const nodes = nodes_of(exec, tree);
    check_tree(nodes, all);
    double sum = 0;
    std::vector<u32> open{0};
    while (!open.empty()) {
      gart::bvh_node const n = nodes[open.back()];
      open.pop_back();
      for (int c = 0; c < gart::bvh_width; ++c) {
        if (!(n.inner_mask() >> c & 1u)) continue;
        open.push_back(n.child[c]);
        vec3 const size = n.child_box(c).hi - n.child_box(c).lo;
        if (size.x < 100 && size.y < 100 && size.z < 100)
          sum += double{size.x} * size.y + double{size.y} * size.z + double{size.z} * size.x;
      }
    }
    return sum;
  };
  // Planes of the codes now cut the scene at other places, which is half as much again at the most; in any order it is
  // over ten times as much.
  double const without = sizes(boxes);
  for (vec3 const& far : {vec3(1e7f, 0, 0), vec3(-1e7f, 1e6f, 1e30f)}) {
    auto strayed = boxes;
    strayed[1234] = {far, far};
    CHECK(sizes(strayed) < 2 * without);
  }
  // One in 400 of them, and a scene of few.
  auto strayed = boxes;
  for (std::size_t i = 0; i < strayed.size(); i += 400) strayed[i] = {vec3(1e8f), vec3(1e8f)};
  CHECK(sizes(strayed) < 2 * without);
  boxes.resize(40);
  strayed = boxes;
  strayed[7] = {vec3(1e8f), vec3(1e8f)};
  CHECK(sizes(strayed) < 2 * sizes(boxes));
}

TEST_CASE_TEMPLATE("a box without an end is met wherever the ray goes", E, GART_TEST_POLICIES) {
  random_boxes source(4);
  E exec;
  std::vector<box> boxes = source.many(200);
  float const endless = std::numeric_limits<float>::infinity();
  boxes.push_back({vec3(-endless), vec3(endless)});
  boxes.push_back({vec3(-endless, -20, -20), vec3(endless, 20, 20)});
  std::vector<gart::ray> rays;
  for (int i = 0; i < 100; ++i) rays.push_back(source.towards(source.point(10)));
  gart::buffer<box, E> on_device(exec, boxes);
  gart::bvh<E> tree(exec);
  tree.build(exec, on_device);
  check_walk(exec, tree, boxes, rays, 0, 1e9f);
}

TEST_CASE("planes of a grid lie close outside the sides") {
  CAPTURE(gart_test::seed());
  random_boxes source(gart_test::seed() + 5);
  auto const any = [&] {
    float const x = std::ldexp(source.uniform(-1, 1), static_cast<int>(source.uniform(-149, 127)));
    return source.uniform(0, 1) < 0.05f ? 0.0f : x;
  };
  long inexact = 0, inside = 0, far = 0, finer = 0;
  for (int i = 0; i < 200'000; ++i) {
    float a = any(), b = i % 3 ? any() : i % 2 ? a : std::nextafter(a, 1e30f);
    if (b < a) std::swap(a, b);
    gart::bvh_axis const axis = gart::axis_between(a, b);
    if (axis.exponent == gart::bvh_axis::unbounded) {
      inside += std::fabs(a) <= 8e37f && std::fabs(b) <= 8e37f;
      continue;
    }
    double const step = axis.step(), origin = axis.origin;
    for (double q : {0.0, 1.0, 77.0, 255.0}) inexact += static_cast<float>(origin + q * step) != origin + q * step;
    // Any side between, as well as the ends.
    float const t = source.uniform(0, 1), middle = std::clamp(a + t * (b - a), a, b);
    for (float x : {a, middle, b}) {
      double const lower = origin + gart::plane_below(axis, x) * step,
                   upper = origin + gart::plane_above(axis, x) * step;
      inside += lower > x || upper < x;
      far += lower + step <= x || upper - step >= x;
    }
    // Half the step would not do: too many planes, or too fine for floats, or no normal float itself.
    bool const too_many = std::ceil(b / step * 2) - std::floor(a / step * 2) > 255;
    bool const too_fine = std::max(std::fabs(a), std::fabs(b)) / step * 2 >= 8388608.0;
    finer += !too_many && !too_fine && axis.exponent > 1;
  }
  CHECK(inexact == 0);
  CHECK(inside == 0);
  CHECK(far == 0);
  CHECK(finer == 0);
}

TEST_CASE_TEMPLATE("a refit with another number of boxes is refused", E, GART_TEST_POLICIES) {
  random_boxes source(3);
  E exec;
  gart::bvh<E> tree(exec);
  gart::buffer<box, E> ten(exec, source.many(10)), eleven(exec, source.many(11));
  tree.build(exec, ten);
  CHECK_THROWS_AS(tree.refit(exec, eleven), gart::invalid_argument);
}
