// The order that a batch's rays go through the tree in: one of all of them, in which neighbours stay close, and which
// no ray sees anything of.
#include <rays/view_rays.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace gart_test;
using gart::u32;

namespace {

// Rays of a small fan, then rays to anywhere.
struct mixed_rays {
  std::vector<float> origins, directions, ends;
  explicit mixed_rays(std::size_t count) {
    random_rays const some(7, count, 0.5f);
    origins = some.origins, directions = some.directions;
    for (std::size_t i = 0; i < count / 2; ++i) {
      float const x = 0.01f * static_cast<float>(i % 16), y = 0.01f * static_cast<float>(i / 16);
      float const length = std::sqrt(x * x + y * y + 1), d[3] = {x / length, y / length, 1 / length};
      for (std::size_t k = 0; k < 3; ++k) directions[3 * i + k] = d[k], origins[3 * i + k] = k == 2 ? -4.0f : 0.0f;
    }
    for (std::size_t i = 0; i < count; ++i) ends.push_back(0.5f + static_cast<float>(i % 9));
  }
};

template <class T>
std::vector<T> picked(std::vector<T> const& from, std::vector<u32> const& places, std::size_t each) {
  std::vector<T> out;
  for (u32 const p : places) out.insert(out.end(), from.begin() + p * each, from.begin() + (p + 1) * each);
  return out;
}

}  // namespace

TEST_CASE_TEMPLATE("rays see the same in whatever order they come", E, GART_TEST_POLICIES) {
  E exec;
  gart::gaussians<E> const scene(exec, cloud(5, 1, 2000));
  gart::ray_tracer<E> tracer(exec);
  tracer.set_scene(scene.view(), 1);
  mixed_rays const rays(999);
  std::vector<u32> places(999);
  std::iota(places.begin(), places.end(), 0u);
  std::shuffle(places.begin(), places.end(), std::mt19937(3));
  for (bool const ended : {false, true}) {
    CAPTURE(ended);
    std::vector<float> const ends = ended ? rays.ends : std::vector<float>{};
    batch_memory<E> const batch(exec, {}, rays.origins, rays.directions, ends);
    batch_memory<E> const shuffled(exec, {}, picked(rays.origins, places, 3), picked(rays.directions, places, 3),
                                   ended ? picked(ends, places, 1) : ends);
    auto const a = trace_all(exec, tracer, batch.rays(), {}), b = trace_all(exec, tracer, shuffled.rays(), {});
    CHECK(picked(a.color, places, 3) == b.color);
    CHECK(picked(a.depth, places, 1) == b.depth);
    CHECK(picked(a.hits, places, 1) == b.hits);
    CHECK(picked(a.top_id, places, 1) == b.top_id);
    CHECK(*std::max_element(a.hits.begin(), a.hits.end()) > 24);
  }
}

TEST_CASE_TEMPLATE("neighbours in the order of a batch stay close", E, GART_TEST_POLICIES) {
  E exec;
  random_rays const some(11, 20000, 0.0f);
  for (bool const from_frame : {true, false}) {
    batch_memory<E> const batch(exec, {}, from_frame ? std::vector<float>{} : some.origins, some.directions);
    gart::ray_order<E> order(exec);
    CHECK(order.of(20000) == nullptr);
    order.make(exec, batch.rays(), {}, {});
    REQUIRE(order.of(20000) != nullptr);
    CHECK(order.of(19999) == nullptr);
    std::vector<u32> places(20000);
    exec.copy_out(places.data(), order.of(20000), sizeof(u32) * places.size());
    auto sorted = places;
    std::sort(sorted.begin(), sorted.end());
    for (u32 i = 0; i < 20000; ++i) REQUIRE(sorted[i] == i);
    double sum = 0;
    for (std::size_t i = 1; i < places.size(); ++i)
      for (std::size_t k = 0; k < 3; ++k)
        sum += std::pow(some.directions[3 * places[i] + k] - some.directions[3 * places[i - 1] + k], 2);
    // A ray has 4 pi / 20000 of the sphere to itself.
    CHECK(std::sqrt(sum / 20000) < 3 * std::sqrt(4 * 3.14159 / 20000));
  }
}
