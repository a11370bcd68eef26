// The two sorts of a step: (tile, primitive) pairs by tile and depth, and the BVH's Morton codes.
#include "support/frame.hpp"

#include <gart/algorithm/sort_pairs.hpp>
#include <gart/bvh/morton.hpp>
#include <gart/tiles/footprints.hpp>

namespace {

template <class Key, gart::execution E>
void sort(benchmark::State& state, E& exec, std::size_t n, int bits) {
  std::mt19937_64 random(3);
  std::vector<Key> host(n);
  for (Key& key : host) key = static_cast<Key>(random() >> (64 - bits));
  gart::buffer<Key, E> const unsorted(exec, host);
  gart::buffer<Key, E> keys(exec, n);
  gart::buffer<gart::u32, E> values(exec, n);
  values.zero();
  gart_bench::measure(
      state, exec, [&] { exec.copy(keys.data(), unsorted.data(), n * sizeof(Key)); },
      [&] { gart::sort_pairs(exec, keys.view(), values.view(), bits); });
  state.SetItemsProcessed(static_cast<std::int64_t>(state.iterations() * n));
  state.counters["key_bits"] = bits;
}

template <gart::execution E>
void sort_tiles(benchmark::State& state, E& exec) {
  gart_bench::frame<E> frame(exec);
  gart::footprints<E, 8> prints(exec);
  prints.measure(exec, frame.scene(), frame.view, frame.options.alpha_min, frame.options.near);
  sort<gart::u32>(state, exec, prints.pairs(), 32);
}

template <gart::execution E>
void sort_morton(benchmark::State& state, E& exec) {
  sort<gart::u64>(state, exec, gart_bench::the_scene().model.size(), gart::morton_bits);
}

}  // namespace

GART_BENCH("sort/tiles", sort_tiles)
GART_BENCH("sort/morton", sort_morton)
