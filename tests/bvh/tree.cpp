// The tree over boxes: its shape and bounds after build and refit, and that a walk visits what a ray crosses, once.
#include <gart/bvh/walk.hpp>
#include <support/policies.hpp>

#include <algorithm>
#include <random>

namespace {

using gart::box;
using gart::u32;
using gart::vec3;

struct counting_visitor {
  u32* visits;
  float from, to;
  GART_HD float near() const { return from; }
  GART_HD float far() const { return to; }
  GART_HD void leaf(u32 id) { ++visits[id]; }
};

struct count_visits {
  gart::bvh_view tree;
  gart::ray const* rays;
  float from, to;
  u32* visits;  // [rays][boxes]
  GART_KERNEL void operator()(gart::index_t i) const {
    counting_visitor v{visits + static_cast<std::size_t>(i) * tree.count, from, to};
    gart::walk(tree, rays[i], v);
  }
};

bool is_empty(box const& b) { return b.lo.x > b.hi.x; }
bool same(box const& a, box const& b) { return a.lo == b.lo && a.hi == b.hi; }

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
  double entry = from, exit = to;
  double const slack = 1e-4;
  for (int k = 0; k < 3; ++k) {
    double const o = r.origin[k], d = r.direction[k];
    if (std::fabs(d) < 1e-12) {
      if (o < b.lo[k] - slack || o > b.hi[k] + slack) return -1;
      if (o < b.lo[k] + slack || o > b.hi[k] - slack) return 0;
      continue;
    }
    double const a = (b.lo[k] - o) / d, c = (b.hi[k] - o) / d;
    entry = std::max(entry, std::min(a, c)), exit = std::min(exit, std::max(a, c));
  }
  return entry + slack < exit ? 1 : entry > exit + slack ? -1 : 0;
}

// Every node's boxes are the unions of what lies below them, every box is one leaf, and no path is longer than a walk's
// stack; returns the union of all.
box check_tree(std::vector<gart::bvh_node> const& nodes, std::vector<box> const& boxes) {
  std::vector<int> leaves(boxes.size(), 0);
  long wrong_bounds = 0, wrong_parents = 0;
  int deepest = 0;
  auto const below = [&](auto const& self, u32 node, int depth) -> box {
    deepest = std::max(deepest, depth);
    box all = gart::empty_box();
    int const children = boxes.size() == 1 ? 1 : 2;
    for (int c = 0; c < children; ++c) {
      u32 const child = nodes[node].child[c];
      box b;
      if (child & gart::bvh_node::leaf) {
        u32 const id = child & ~gart::bvh_node::leaf;
        REQUIRE(id < boxes.size());
        if (++leaves[id] > 1) continue;
        b = boxes[id];
      } else {
        REQUIRE(child < nodes.size());
        REQUIRE(depth < 100);
        wrong_parents += nodes[child].parent != (node << 1 | static_cast<u32>(c));
        b = self(self, child, depth + 1);
      }
      wrong_bounds += !same(nodes[node].child_box(c), b);
      all = gart::join(all, b);
    }
    return all;
  };
  box const all = below(below, 0, 1);
  CHECK(wrong_bounds == 0);
  CHECK(wrong_parents == 0);
  CHECK(deepest <= 96);
  CHECK(std::all_of(leaves.begin(), leaves.end(), [](int n) { return n == 1; }));
  return all;
}

template <class E>
std::vector<gart::bvh_node> nodes_of(E& exec, gart::bvh<E> const& tree) {
  std::vector<gart::bvh_node> nodes(std::max<std::size_t>(tree.view().count, 2) - 1);
  exec.copy_out(nodes.data(), tree.view().nodes, nodes.size() * sizeof(gart::bvh_node));
  return nodes;
}

template <class E>
void check_walk(E& exec, gart::bvh<E> const& tree, std::vector<box> const& boxes, std::vector<gart::ray> const& rays,
                float from, float to) {
  gart::buffer<gart::ray, E> on_device(exec, rays);
  gart::buffer<u32, E> visits(exec, rays.size() * boxes.size() + 1);
  visits.zero();
  gart::parallel_for(exec, "visits", static_cast<u32>(rays.size()),
                     count_visits{tree.view(), on_device.data(), from, to, visits.data()});
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
  if (n > 0) CHECK(same(check_tree(nodes_of(exec, tree), moved), check_tree(nodes_of(exec, anew), moved)));
  check_walk(exec, tree, moved, rays, 0, 1e9f);
}

}  // namespace

TEST_CASE_TEMPLATE("a walk visits every box a ray crosses, once", E, GART_TEST_POLICIES) {
  CAPTURE(gart_test::seed());
  random_boxes source(gart_test::seed());
  E exec;
  for (std::size_t n : {0, 1, 2, 3, 4, 5, 17, 100, 1000, 20000}) check_boxes(exec, source, source.many(n));
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

TEST_CASE_TEMPLATE("a refit with another number of boxes is refused", E, GART_TEST_POLICIES) {
  random_boxes source(3);
  E exec;
  gart::bvh<E> tree(exec);
  gart::buffer<box, E> ten(exec, source.many(10)), eleven(exec, source.many(11));
  tree.build(exec, ten);
  CHECK_THROWS_AS(tree.refit(exec, eleven), gart::invalid_argument);
}
