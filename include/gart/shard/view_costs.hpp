#pragma once
/// \file
/// The cost of each row of tiles, from when ranks last traced the view; the same on all ranks. The next time, the view
/// is cut by these costs (work_units.hpp). So no rank waits for the counts of others before it knows its part. A view
/// changes little between two visits. Images and gradients do not depend on the cut.
///
/// box_kernel gives the costs. For each view they are the difference of each row's cost to the row above, in wrapping
/// arithmetic. One more number stands at the end. Views follow one another. Memory: 8 bytes a row of tiles.

#include <gart/core/isa.hpp>
#include <gart/core/types.hpp>
#include <gart/scene/camera.hpp>
#include <gart/tiles/grid.hpp>

#include <iterator>
#include <map>
#include <numeric>
#include <utility>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// Costs by a number that the caller chooses for each view. Size: side of a tile.
template <int Size>
class view_costs {
 public:
  /// How many numbers the costs of these views are.
  static std::size_t count(std::vector<camera> const& views) {
    std::size_t all = 0;
    for (camera const& view : views) all += rows_of(view) + 1;
    return all;
  }
  /// These numbers as costs, by view and row of tiles.
  static std::vector<std::vector<u64>> by_view(std::vector<camera> const& views, std::vector<u64> const& steps) {
    std::vector<std::vector<u64>> costs;
    auto at = steps.begin();
    for (camera const& view : views) {
      auto const end = at + static_cast<std::ptrdiff_t>(rows_of(view));
      std::partial_sum(at, end, std::back_inserter(costs.emplace_back()));
      at = end + 1;
    }
    return costs;
  }

  /// Whether all these views were traced before; false for views without a name.
  bool knows(std::vector<std::size_t> const& names) const {
    for (std::size_t const name : names)
      if (!costs_.contains(name)) return false;
    return !names.empty();
  }
  /// The costs of known views.
  std::vector<std::vector<u64>> of(std::vector<std::size_t> const& names) const {
    std::vector<std::vector<u64>> costs;
    for (std::size_t const name : names) costs.push_back(costs_.at(name));
    return costs;
  }
  /// Does nothing where views have no names.
  void remember(std::vector<std::size_t> const& names, std::vector<std::vector<u64>> costs) {
    for (std::size_t v = 0; v < names.size(); ++v) costs_[names[v]] = std::move(costs[v]);
  }

 private:
  static std::size_t rows_of(camera const& view) { return tile_grid<Size>{view.width, view.height}.rows(); }

  std::map<std::size_t, std::vector<u64>> costs_;
};

}}  // namespace gart::GART_ISA
