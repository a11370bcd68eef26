// The BVH on its own, header-only: for every ray, how many boxes it crosses. bvh_query [BOXES]
#include <gart/bvh/bvh.hpp>
#include <gart/bvh/walk.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/math/ray_gaussian.hpp>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

// What a walk asks of its visitor: the part of the ray that matters, and what to do with a leaf. A walk proposes boxes;
// which of them the ray crosses, the visitor finds out. This one counts all; one that sought the nearest would lower
// far() as it goes.
struct counter {
  gart::span<gart::box const> boxes;
  gart::slab_ray ray;
  gart::u32 count = 0;
  float near() const { return 0.0f; }
  float far() const { return gart::infinity; }
  void leaf(gart::u32 box) { count += crosses(boxes[box], ray, near(), far()); }
};

struct count_boxes {
  gart::bvh_view tree;
  gart::span<gart::box const> boxes;
  gart::span<gart::ray const> rays;
  gart::span<gart::u32> counts;
  void operator()(gart::index_t i) const {
    counter crossed{boxes, gart::slab_ray(rays[i])};
    walk(tree, rays[i], crossed);
    counts[i] = crossed.count;
  }
};

int main(int argc, char** argv) {
  std::size_t const n = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 100'000;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(-1.0f, 1.0f);
  auto const point = [&] { return gart::vec3(uniform(random), uniform(random), uniform(random)); };

  std::vector<gart::box> boxes(n);
  for (gart::box& b : boxes) {
    gart::vec3 const center = point();
    b = {center - gart::vec3(0.002f), center + gart::vec3(0.002f)};
  }
  std::vector<gart::ray> rays(20'000);
  for (gart::ray& r : rays) {
    gart::vec3 const d = point();
    r = {point(), d / std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z)};
  }

  gart::openmp_exec exec;
  gart::buffer<gart::box, gart::openmp_exec> scene(exec, boxes);
  gart::buffer<gart::ray, gart::openmp_exec> queries(exec, rays);
  gart::buffer<gart::u32, gart::openmp_exec> counts(exec, rays.size());
  gart::bvh<gart::openmp_exec> tree(exec);

  auto const start = std::chrono::steady_clock::now();
  tree.build(exec, scene);
  auto const built = std::chrono::steady_clock::now();
  parallel_for(exec, "count boxes", static_cast<gart::index_t>(rays.size()),
               count_boxes{tree.view(), scene, queries, counts});
  auto const done = std::chrono::steady_clock::now();

  unsigned long long crossed = 0;
  for (gart::u32 const c : counts.to_host()) crossed += c;
  std::chrono::duration<double, std::milli> const build = built - start, query = done - built;
  std::printf("%zu boxes: built in %.1f ms; %zu rays crossed %llu of them in %.1f ms\n", n, build.count(), rays.size(),
              crossed, query.count());
  return 0;
}
