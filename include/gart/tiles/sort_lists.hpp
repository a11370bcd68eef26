#pragma once
/// \file
/// The lists of a tile map on a device, by tiles instead of by digits: pairs are counted where they are emitted, a scan
/// of the counts says where each list begins, pairs go there in no order, and a team sorts each list in shared memory,
/// the longest first. Lists that have no room there are sorted in runs, which are merged. What comes out is what a
/// stable sort of keys gives, since a pair's key and primitive together are unlike any other's. Cost: of lists of n
/// pairs log2(n)^2 / 2 steps in shared memory, where digits take as many passes over all pairs as a key has bytes.

#include <gart/core/span.hpp>
#include <gart/exec/concepts.hpp>

namespace gart { inline namespace GART_ISA { namespace tile_kernels {

// The tiles by the length of their lists, longest first, in 255 steps of 16: one team counts them. Lists differ by
// orders of magnitude, and a long one begun last would keep the whole device waiting.
template <execution E>
struct rank_tiles {
  static constexpr int block_size = 1024, min_blocks = 1;
  static constexpr u32 step = 16, ranks = 256, part = 16;
  struct scratch {
    u32 count[ranks], of_parts[ranks / part], place[ranks];
  };
  span<u32 const> offsets;  // [tiles + 1]
  span<u32> longest_first;  // [tiles]

  GART_KERNEL void operator()(auto const& team) const {
    scratch& s = team.scratch();
    index_t const tiles = static_cast<index_t>(longest_first.size());
    team.for_each(ranks, [&](index_t r) { s.count[r] = 0; });
    team.barrier();
    team.for_each(tiles, [&](index_t t) { E::atomic_add(&s.count[rank_of(t)], u32{1}); });
    team.barrier();
    team.for_each(ranks / part, [&](index_t p) {
      s.of_parts[p] = 0;
      for (u32 r = p * part; r < (p + 1) * part; ++r) s.of_parts[p] += s.count[r];
    });
    team.barrier();
    team.for_each(ranks, [&](index_t r) {
      u32 before = 0;
      for (u32 p = 0; p < r / part; ++p) before += s.of_parts[p];
      for (u32 k = r / part * part; k < r; ++k) before += s.count[k];
      s.place[r] = before;
    });
    team.barrier();
    team.for_each(tiles, [&](index_t t) { longest_first[E::atomic_add(&s.place[rank_of(t)], u32{1})] = t; });
    team.barrier();
  }

 private:
  GART_HD u32 rank_of(index_t t) const {
    u32 const steps = (offsets[t + 1] - offsets[t]) / step;
    return ranks - 1 - (steps < ranks - 1 ? steps : ranks - 1);
  }
};

// Pairs to their lists: key and primitive as one number. Keys of no tile are of tile `tiles`.
template <execution E>
struct scatter_pairs {
  span<u32 const> keys, primitives;
  int order_bits;
  u32 tiles;
  span<u32 const> offsets;
  span<u32> left;  // of each tile's pairs, those that have not come yet
  span<u64> lists;
  GART_KERNEL void operator()(index_t i) const {
    u32 const key = keys[i], tile = key >> order_bits;
    if (tile < tiles) lists[offsets[tile] + E::atomic_add(&left[tile], ~u32{0}) - 1] = u64{key} << 32 | primitives[i];
  }
};

// A team a tile.
struct sort_lists {
  static constexpr int block_size = 128, min_blocks = 12;
  static constexpr u32 run = 1024;  // pairs that are sorted in scratch
  static constexpr u32 piece = 16;  // of a merge, a lane's
  struct scratch {
    u64 pairs[run];
  };
  span<u32 const> longest_first, offsets;
  span<u64> lists;
  span<u32> keys, primitives;

  GART_KERNEL void operator()(auto const& team) const {
    u32 const tile = longest_first[team.tile()], first = offsets[tile], count = offsets[tile + 1] - first;
    // A merge goes from `lists` to keys and primitives or back, the last one to these.
    bool to_lists = false;
    for (u32 width = run; width < count; width *= 2) to_lists = !to_lists;
    u64* const x = team.scratch().pairs;
    for (u32 from = 0; from < count; from += run) {
      u32 const n = count - from < run ? count - from : run;
      team.for_each(n, [&](index_t k) { x[k] = lists[first + from + k]; });
      team.barrier();
      sort(team, x, n);
      team.for_each(n, [&](index_t k) { put(to_lists, first + from + k, x[k]); });
      team.barrier();
    }
    for (u32 width = run; width < count; width *= 2) {
      to_lists = !to_lists;
      team.for_each((count + piece - 1) / piece, [&](index_t p) { merge(to_lists, first, count, width, p * piece); });
      team.barrier();
    }
  }

 private:
  // A bitonic network whose comparisons all have the lesser at the lower place, so that what lies past n counts as
  // infinite and stays there.
  GART_HD GART_INLINE static void sort(auto const& team, u64* x, u32 n) {
    if (n < 2) return;
    u32 pairs = 1;
    while (2 * pairs < n) pairs *= 2;
    auto const order = [&](u32 low, u32 high) {
      if (high >= n) return;
      u64 const a = x[low], b = x[high];
      if (b < a) x[low] = b, x[high] = a;
    };
    for (int bits = 0; u32{1} << bits < n; ++bits) {
      team.for_each(pairs, [&](index_t i) {
        u32 const begin = i >> bits << (bits + 1), at = i & ((u32{1} << bits) - 1);
        order(begin + at, begin + (u32{2} << bits) - 1 - at);
      });
      team.barrier();
      for (int b = bits - 1; b >= 0; --b) {
        team.for_each(pairs, [&](index_t i) {
          u32 const low = (i >> b << (b + 1)) + (i & ((u32{1} << b) - 1));
          order(low, low + (u32{1} << b));
        });
        team.barrier();
      }
    }
  }

  GART_HD GART_INLINE void put(bool to_lists, u32 k, u64 pair) const {
    if (to_lists)
      lists[k] = pair;
    else
      keys[k] = static_cast<u32>(pair >> 32), primitives[k] = static_cast<u32>(pair);
  }
  GART_HD GART_INLINE u64 get(bool from_lists, u32 k) const {
    return from_lists ? lists[k] : u64{keys[k]} << 32 | primitives[k];
  }

  // Of runs of that width, merged by twos, those pairs that come to [at, at + piece) of the list.
  GART_HD void merge(bool to_lists, u32 first, u32 count, u32 width, u32 at) const {
    auto const pair = [&](u32 k) { return get(!to_lists, first + k); };
    u32 const begin = at / (2 * width) * (2 * width), end = begin + 2 * width < count ? begin + 2 * width : count;
    u32 const middle = begin + width < end ? begin + width : end;
    // How many of the first run come before: all of whom less than `at - begin` of both are less.
    u32 const before = at - begin;
    u32 least = before > end - middle ? before - (end - middle) : 0;
    u32 most = before < middle - begin ? before : middle - begin;
    while (least < most) {
      u32 const half = (least + most) / 2;
      if (pair(begin + half) < pair(middle + before - half - 1))
        least = half + 1;
      else
        most = half;
    }
    u32 a = begin + least, b = middle + before - least;
    for (u32 k = at; k < at + piece && k < end; ++k) {
      bool const first_run = b >= end || (a < middle && pair(a) < pair(b));
      put(to_lists, first + k, pair(first_run ? a++ : b++));
    }
  }
};

}}}  // namespace gart::GART_ISA::tile_kernels
