#pragma once
/// \file
/// What each rank traces in a round of a step: one view, and of its image some rows of tiles. Views and ranks may be
/// any number: where there are fewer views than ranks, ranks share one, in strips of equal cost; where there are more,
/// a step has several rounds.
///
/// Cost: counted, for the view itself, as its (primitive, tile) pairs a row of tiles. Strips follow each other down the
/// image in the order of ranks, which is what keeps sums over pairs in one order, whatever the number of ranks.

#include <gart/core/error.hpp>
#include <gart/core/span.hpp>
#include <gart/core/types.hpp>
#include <gart/scene/image_rows.hpp>

#include <algorithm>
#include <vector>

namespace gart {

/// A rank's part of a round.
struct work_unit {
  int view = 0;            ///< which of the round's
  int first = 0, end = 0;  ///< rows of tiles; none where the image has fewer than there are ranks for it
  image_rows rows = {};    ///< the same in pixels

  /// Whether there is nothing to trace.
  bool empty() const { return first >= end; }
};

/// The view that a rank takes of a round of `views`, at most `ranks`: neighbours share one.
constexpr int view_of_rank(int rank, int ranks, int views) {
  return static_cast<int>(static_cast<long long>(rank) * views / ranks);
}

/// `cost` of each row of tiles, cut into parts of about the same: part k is rows [cuts[k], cuts[k + 1]). Without any
/// cost, parts of about as many rows.
inline std::vector<int> cut_evenly(span<u64 const> cost, int parts) {
  int const rows = static_cast<int>(cost.size());
  u64 total = 0;
  for (u64 const c : cost) total += c;
  std::vector<int> cuts(static_cast<std::size_t>(parts) + 1, rows);
  cuts[0] = 0;
  u64 before = 0;
  int row = 0;
  for (int k = 1; k < parts; ++k) {
    if (total == 0) {
      cuts[static_cast<std::size_t>(k)] = rows * k / parts;
      continue;
    }
    // Where the middle of a row lies past the cut, the row is the next part's.
    u64 const wanted = total / static_cast<u64>(parts) * static_cast<u64>(k);
    while (row < rows && before + cost[static_cast<std::size_t>(row)] / 2 < wanted)
      before += cost[static_cast<std::size_t>(row++)];
    cuts[static_cast<std::size_t>(k)] = row;
  }
  return cuts;
}

/// A unit for each rank. costs[v]: of each row of tiles of view v.
inline std::vector<work_unit> divide_work(std::vector<std::vector<u64>> const& costs, int ranks, int tile_size) {
  int const views = static_cast<int>(costs.size());
  if (views < 1 || views > ranks) throw invalid_argument("divide_work: a round has from one view to one a rank");
  std::vector<work_unit> units(static_cast<std::size_t>(ranks));
  for (int rank = 0; rank < ranks;) {
    int const view = view_of_rank(rank, ranks, views);
    int next = rank;
    while (next < ranks && view_of_rank(next, ranks, views) == view) ++next;
    auto const& cost = costs[static_cast<std::size_t>(view)];
    auto const cuts = cut_evenly({cost.data(), cost.size()}, next - rank);
    for (int k = 0; rank < next; ++rank, ++k) {
      int const first = cuts[static_cast<std::size_t>(k)], end = cuts[static_cast<std::size_t>(k) + 1];
      // The last row of tiles may go on past the image, and so may its unit.
      units[static_cast<std::size_t>(rank)] = {view, first, end, {first * tile_size, end * tile_size}};
    }
  }
  return units;
}

}  // namespace gart
