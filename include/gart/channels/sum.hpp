#pragma once
/// \file
/// The forward pass of a channel: its sums over the hits of each ray of a table.
///
///   sum_channel(exec, table.view(), feature_channel<chunk_of<E>>{{}, features}, out);   // [R][width]
///
/// A lane sums a chunk of a ray's numbers. A launch takes the numbers of its lanes' chunks. So wide channels take
/// several launches over the same lists. Cost a launch: 12 bytes a hit, and its numbers, read once.

#include <gart/channels/hit_table.hpp>
#include <gart/exec/parallel.hpp>

#include <algorithm>

namespace gart { inline namespace GART_ISA {

/// Numbers of a wide channel that a lane sums: vectors of a host, four neighbours on a device.
template <execution E>
inline constexpr int chunk_of = E::device ? 4 : 32;

namespace channel_kernels {

template <channel C>
struct sum_hits {
  hit_table_view hits;
  C from;
  int first, last, lanes;  // numbers of this launch; lanes a ray
  float* out;              // [R][width]
  GART_KERNEL void operator()(index_t i) const {
    index_t const ray = i / static_cast<index_t>(lanes);
    int const begin = first + C::chunk * static_cast<int>(i % static_cast<index_t>(lanes));
    int const n = last - begin < C::chunk ? last - begin : C::chunk;
    float sums[C::chunk] = {};
    for (u64 k = hits.offsets[ray]; k < hits.offsets[ray + 1]; ++k) from.add(hits.at(k, ray), begin, n, sums);
    float* const to = out + static_cast<std::size_t>(ray) * static_cast<std::size_t>(from.width()) + begin;
    for_each_number<C::chunk>(n, [&](int k) { to[k] = sums[k]; });
  }
};

// Calls f(first, last, lanes) for each launch over `width` numbers of so many rows, a lane a chunk. Lanes that lie
// together share what a host's caches and a device's warps have read of hits. Their count fits in 32 bits.
template <int Chunk, class F>
void for_each_launch(index_t rows, int width, F&& f) {
  int const lanes = rows > 0xffffffffu / 8 ? 1 : Chunk > 8 ? 4 : 8;
  for (int first = 0; first < width; first += lanes * Chunk) {
    int const last = std::min(first + lanes * Chunk, width);
    f(first, last, (last - first + Chunk - 1) / Chunk);
  }
}

}  // namespace channel_kernels

/// `out`: [R][width], overwritten.
template <execution E, channel C>
void sum_channel(E& exec, hit_table_view const& hits, C const& from, float* out) {
  channel_kernels::for_each_launch<C::chunk>(hits.ray_count, from.width(), [&](int first, int last, int lanes) {
    parallel_for(exec, "channels/sum", hits.ray_count * static_cast<index_t>(lanes),
                 channel_kernels::sum_hits<C>{hits, from, first, last, lanes, out});
  });
}

}}  // namespace gart::GART_ISA
