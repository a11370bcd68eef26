#pragma once
/// \file
/// A unit is a rank's part of a round: one view, and some rows of tiles of its image. If there are fewer views than
/// ranks, ranks share a view in strips of equal cost. If there are more, a step has several rounds.
///
/// The cost of a row of tiles is the number of its (primitive, tile) pairs. Strips lie down the image in the order of
/// ranks. So sums over pairs have one order for any number of ranks.

#include <gart/core/error.hpp>
#include <gart/core/span.hpp>
#include <gart/core/types.hpp>
#include <gart/scene/image_rows.hpp>

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

/// Cuts rows of tiles into parts of about equal cost: part k is rows [cuts[k], cuts[k + 1]). Without any cost, parts of
/// about as many rows.
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
    // A row whose middle lies past the cut belongs to the next part.
    u64 const wanted = total / static_cast<u64>(parts) * static_cast<u64>(k);
    while (row < rows && before + cost[static_cast<std::size_t>(row)] / 2 < wanted)
      before += cost[static_cast<std::size_t>(row++)];
    cuts[static_cast<std::size_t>(k)] = row;
  }
  return cuts;
}

/// A unit for each rank. costs[v]: the cost of each row of tiles of view v.
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
      // The last row of tiles, and its unit, may extend past the image.
      units[static_cast<std::size_t>(rank)] = {view, first, end, {first * tile_size, end * tile_size}};
    }
  }
  return units;
}

}  // namespace gart
