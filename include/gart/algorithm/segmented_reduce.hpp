#pragma once
/// \file
/// Sums of runs of rows, in a fixed order: sums[s][c] = rows[offsets[s]][c] + ... + rows[offsets[s + 1] - 1][c].
///
/// rows: float, row-major, `columns` wide. offsets: segments + 1 row numbers (u32 or u64), ascending, as exclusive_scan
/// writes them with its total behind. sums: segments x columns, overwritten; an empty segment gives 0. The order of
/// additions depends on the segment's length only, and all policies share it. So all give the same bits. Cost: reads
/// rows once, one lane a (segment, column). Errors: invalid_argument for a short span, or for more than 2^32 - 1 sums.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/exec/parallel.hpp>

namespace gart {

/// Compiled into gart::cuda.
void segmented_reduce(cuda_exec& exec, span<float const> rows, u32 columns, span<u32 const> offsets, span<float> sums);
/// Compiled into gart::cuda; offsets past 32 bits.
void segmented_reduce(cuda_exec& exec, span<float const> rows, u32 columns, span<u64 const> offsets, span<float> sums);

}  // namespace gart

namespace gart { inline namespace GART_ISA {

namespace detail {

template <class O>
struct sum_segments {
  span<float const> rows;
  u32 columns;
  span<O const> offsets;
  span<float> sums;

  GART_KERNEL void operator()(index_t i) const {
    index_t const segment = i / columns, column = i % columns;
    u64 const begin = offsets[segment], end = offsets[segment + 1];
    // Four sums, taken in turn, so that four loads are under way at once.
    float sum[4] = {0, 0, 0, 0};
    u64 r = begin;
    for (; r + 4 <= end; r += 4)
      for (u32 k = 0; k < 4; ++k) sum[k] += rows[(r + k) * columns + column];
    for (u32 k = 0; r < end; ++r, ++k) sum[k] += rows[r * columns + column];
    sums[i] = (sum[0] + sum[1]) + (sum[2] + sum[3]);
  }
};

template <class E, class O>
void segmented_reduce(E& exec, span<float const> rows, u32 columns, span<O const> offsets, span<float> sums) {
  if (offsets.size() < 2 || columns == 0) return;
  u64 const count = (offsets.size() - 1) * u64{columns};
  require_size("segmented_reduce", "sums", sums.size(), count);
  if (count > ~index_t{0})
    throw invalid_argument("segmented_reduce: " + std::to_string(count) +
                           " sums pass 2^32 - 1; reduce fewer segments at a time");
  parallel_for(exec, "segmented_reduce", static_cast<index_t>(count), sum_segments<O>{rows, columns, offsets, sums});
}

}  // namespace detail

/// On a host.
template <host_execution E>
void segmented_reduce(E& exec, span<float const> rows, u32 columns, span<u32 const> offsets, span<float> sums) {
  detail::segmented_reduce(exec, rows, columns, offsets, sums);
}
/// On a host; offsets past 32 bits.
template <host_execution E>
void segmented_reduce(E& exec, span<float const> rows, u32 columns, span<u64 const> offsets, span<float> sums) {
  detail::segmented_reduce(exec, rows, columns, offsets, sums);
}

}}  // namespace gart::GART_ISA
