#pragma once
/// \file
/// Finds which rows each rank needs in a round of a step. An owner finds the boxes of its rows in each view. A row goes
/// to the ranks whose tiles its box meets.
///
/// Memory: 16 bytes for each of this rank's rows and each view, 12 a row and unit. The host waits once, for the counts.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/camera/models.hpp>
#include <gart/comm/communicator.hpp>
#include <gart/comm/row_owners.hpp>
#include <gart/exec/parallel.hpp>
#include <gart/render/antialiased.hpp>
#include <gart/render/options.hpp>
#include <gart/shard/view_costs.hpp>
#include <gart/shard/work_units.hpp>
#include <gart/tiles/footprint_slots.hpp>

#include <algorithm>
#include <type_traits>
#include <utility>
#include <vector>

namespace gart { inline namespace GART_ISA {

namespace detail {

// The box of a row in a view. cost: for each row of tiles, its pairs less those of the row above. Only one row in
// `every` is counted, with 0 none: many atomic additions to few addresses are slow.
template <class Response, class E, int Size, class Bounds>
struct box_kernel {
  gaussians_view<float const> scene;
  Bounds bounds;
  vec3d frame;
  float alpha_min;
  footprint_slots* boxes;
  u64* cost;
  index_t every;
  GART_KERNEL void operator()(index_t i) const {
    footprint const f = footprint_of<Response>(bounds, load_parameters(scene, i), frame, alpha_min);
    footprint_slots const range(0, f.box, f.seam);
    boxes[i] = range;
    if (every == 0 || i % every != 0 || f.box.empty()) return;
    pixel_box const tiles = tiles_of<Size>(range);
    u64 const pairs = u64{tiles.width()} * every;
    E::atomic_add(cost + tiles.y0, pairs);
    E::atomic_add(cost + tiles.y1, ~pairs + 1);
  }
};

// The part of a box in some rows, as footprints cut it.
GART_HD inline pixel_box cut(pixel_box box, image_rows const& rows) {
  if (box.y0 < rows.first) box.y0 = static_cast<u16>(rows.first);
  if (box.y1 > rows.end) box.y1 = static_cast<u16>(rows.end);
  return box;
}

// A unit takes the rows whose boxes in its view meet its own rows of the image.
struct taken_unit {
  footprint_slots const* boxes;
  image_rows rows;
};

// Whether each row goes to each unit, [units][rows]: one launch for all units, since the latency dominates.
struct select_kernel {
  taken_unit const* units;
  index_t count, rows;
  u32* flags;
  GART_KERNEL void operator()(index_t i) const {
    for (index_t u = 0; u < count; ++u)
      flags[std::size_t{u} * rows + i] = !cut(units[u].boxes[i].box, units[u].rows).empty();
  }
};

// The number of a box's pairs that began above the rows; 0 for boxes that begin with them. `range` may be cut to the
// rows.
template <int Size>
GART_HD inline u32 continued_pairs(footprint_slots range, image_rows const& rows) {
  range.box = cut(range.box, rows);
  return rows.first > 0 && range.box.y0 == rows.first ? tiles_of<Size>(range).area() : 0;
}

// The place of a row that does not go to a unit.
inline constexpr u32 not_sent = ~u32{0};

// The exchange's bytes for each row of a rank, sent or not. A view needs a box, a unit a place and its sum.
constexpr u64 exchange_bytes_of_row(int views, int units) {
  return static_cast<u64>(views) * sizeof(footprint_slots) + static_cast<u64>(units) * (sizeof(u32) + sizeof(u64));
}

// The k-th count of the rows before each unit, and of all.
struct unit_ends_kernel {
  u64 const* places;
  index_t rows;
  u64* ends;
  GART_KERNEL void operator()(index_t k) const { ends[k] = places[std::size_t{k} * rows]; }
};

// place_of is select_kernel's flags, and becomes places among those that go to a unit: its first is ends[u] of all.
template <int Size>
struct list_kernel {
  taken_unit const* units;
  index_t count, rows;
  u64 const *places, *ends;
  u32 *list, *pairs, *place_of;
  GART_KERNEL void operator()(index_t i) const {
    for (index_t u = 0; u < count; ++u) {
      std::size_t const at = std::size_t{u} * rows + i;
      u64 const place = places[at];
      bool const goes = place_of[at];
      place_of[at] = goes ? static_cast<u32>(place - ends[u]) : not_sent;
      if (goes) list[place] = i, pairs[place] = continued_pairs<Size>(units[u].boxes[i], units[u].rows);
    }
  }
};

// The sums that a rank sent back for its unit, from `first` on among all received.
struct returned_unit {
  int view;
  u64 first;
  u32 const* place_of;  // of each row of this rank's, in the unit
};

}  // namespace detail

/// Comm: a communicator for E. Size: side of a tile. Response: the Gaussians'.
template <execution E, class Comm, int Size, class Response>
requires communicator<Comm, E>
class row_selection {
 public:
  /// Selects nothing yet. `exec` must outlive it.
  row_selection(E& exec, Comm comm, row_owners const& owners)
      : exec_(&exec),
        comm_(std::move(comm)),
        owners_(owners),
        filter_(exec),
        place_of_(exec),
        list_(exec),
        pairs_(exec),
        taken_(exec),
        returned_(exec),
        told_(exec) {}

  /// Selects rows for the round's views, at most one a rank. `names`: numbers to remember the views' costs by; may be
  /// empty. `places` is memory for a scan. All ranks call it together.
  void find(gaussians_view<float const> scene, std::vector<camera> const& views, std::vector<std::size_t> const& names,
            render_options const& options, buffer<u64, E>& places) {
    measure(scene, views, names, options);
    std::vector<u64> costs = select(scene.count, places);
    exchange_counts(costs);
    if (!costs.empty()) costs_.remember(names, costs_.by_view(views, costs));
  }

  /// The units of all ranks.
  std::vector<work_unit> const& units() const { return units_; }
  /// Whether each rank traces a whole view.
  bool whole_views() const { return whole_views_; }
  /// How many rows go to each rank.
  std::vector<u64> const& leaving() const { return leaving_; }
  /// How many rows come from each rank.
  std::vector<u64> const& arriving() const { return arriving_; }
  /// The rows that go, by rank.
  u32 const* rows() const { return list_.data(); }
  /// How many pairs of each row began in an earlier strip.
  span<u32 const> pairs() const { return span<u32 const>(pairs_); }
  /// The first of the units that trace the views [first, end), and how many there are.
  std::pair<detail::returned_unit const*, index_t> returned(int first, int end) const {
    auto const begin = std::lower_bound(returned_views_.begin(), returned_views_.end(), first),
               past = std::lower_bound(begin, returned_views_.end(), end);
    return {returned_.data() + (begin - returned_views_.begin()), static_cast<index_t>(past - begin)};
  }

 private:
  // Finds the boxes of this rank's rows in each view, and the units of all ranks. Units follow from the views' costs at
  // their last trace, or now for a new view. Present costs come with the counts. A view that one rank traces alone
  // needs no cost.
  void measure(gaussians_view<float const> scene, std::vector<camera> const& views,
               std::vector<std::size_t> const& names, render_options const& options) {
    bool const shared = views.size() < static_cast<std::size_t>(owners_.ranks);
    whole_views_ = !shared;
    constexpr index_t counted = 1 << 16;  // about so many rows of a rank estimate the cost of a view's strips
    index_t const every = shared ? 1 + scene.count / counted : 0;
    std::size_t const ends = static_cast<std::size_t>(owners_.ranks) + 1, costs = shared ? costs_.count(views) : 0;
    told_.resize(ends + costs), told_.zero();
    u64* cost = told_.data() + ends;
    while (boxes_.size() < views.size()) boxes_.emplace_back(*exec_);
    for (std::size_t v = 0; v < views.size(); ++v) {
      boxes_[v].resize(scene.count);
      auto const seen = filter_.of(*exec_, scene, views[v], options.antialias);
      visit_camera(views[v], [&](auto const& model) {
        auto const bounds = model.bounds(options.near);
        parallel_for(*exec_, "exchange/boxes", scene.count,
                     detail::box_kernel<Response, E, Size, std::remove_const_t<decltype(bounds)>>{
                         seen, bounds, model.position, options.alpha_min, boxes_[v].data(), cost, every});
      });
      if (shared) cost += costs_.count({views[v]});
    }
    if (shared && costs_.knows(names)) {
      units_ = divide_work(costs_.of(names), owners_.ranks, Size);
      return;
    }
    std::vector<u64> now(costs_.count(views));
    if (shared) {
      exec_->copy_out(now.data(), told_.data() + ends, costs * sizeof(u64));
      comm_.all_reduce(span<u64>(now.data(), costs));
    }
    units_ = divide_work(costs_.by_view(views, now), owners_.ranks, Size);
  }

  // Finds which rows go to which rank: one scan over the units, for one wait. Returns the cost of this rank's rows in
  // each view.
  std::vector<u64> select(index_t rows, buffer<u64, E>& places) {
    std::size_t const units = units_.size(), all = rows * units;
    leaving_.assign(units, 0), returned_views_.clear();
    place_of_.resize(all), places.resize(all + 1);
    std::vector<detail::taken_unit> taken;
    for (work_unit const& u : units_) taken.push_back({boxes_[static_cast<std::size_t>(u.view)].data(), u.rows});
    taken_.assign(taken);
    index_t const count = static_cast<index_t>(units);
    if (rows) {
      parallel_for(*exec_, "exchange/select", rows,
                   detail::select_kernel{taken_.data(), count, rows, place_of_.data()});
      exclusive_scan(*exec_, span<u32 const>(place_of_), places.view().subspan(0, all), places.view().subspan(all, 1));
      parallel_for(*exec_, "exchange/select", count + 1, detail::unit_ends_kernel{places.data(), rows, told_.data()});
    }
    std::vector<u64> ends = told_.to_host();
    std::vector<u64> costs(ends.begin() + static_cast<std::ptrdiff_t>(units + 1), ends.end());
    ends.resize(units + 1);
    list_.resize(ends.back()), pairs_.resize(ends.back());
    if (rows)
      parallel_for(*exec_, "exchange/list", rows,
                   detail::list_kernel<Size>{taken_.data(), count, rows, places.data(), told_.data(), list_.data(),
                                             pairs_.data(), place_of_.data()});
    std::vector<detail::returned_unit> returned;
    for (std::size_t r = 0; r < units; ++r) {
      if (units_[r].empty() || rows == 0) continue;
      returned.push_back({units_[r].view, ends[r], place_of_.data() + r * rows});
      returned_views_.push_back(units_[r].view);
      leaving_[r] = ends[r + 1] - ends[r];
    }
    returned_.assign(returned);
    return costs;
  }

  // Tells each rank how many rows come to it; `costs` become the sums over ranks.
  void exchange_counts(std::vector<u64>& costs) {
    std::size_t const ranks = units_.size(), me = static_cast<std::size_t>(owners_.rank), width = ranks + costs.size();
    std::vector<u64> mine = leaving_, all(ranks * width);
    mine.insert(mine.end(), costs.begin(), costs.end());
    comm_.all_gather(mine.data(), all.data(), width * sizeof(u64));
    costs.assign(costs.size(), 0), arriving_.resize(ranks);
    for (std::size_t r = 0; r < ranks; ++r) {
      arriving_[r] = all[r * width + me];
      for (std::size_t k = 0; k < costs.size(); ++k) costs[k] += all[r * width + ranks + k];
    }
  }

  E* exec_;
  Comm comm_;
  row_owners owners_;
  antialiased<E> filter_;
  std::vector<buffer<footprint_slots, E>> boxes_;  // boxes of this rank's rows, by view
  std::vector<work_unit> units_;
  view_costs<Size> costs_;
  bool whole_views_ = false;
  std::vector<u64> leaving_, arriving_;  // by rank
  buffer<u32, E> place_of_;              // place of each row in each unit
  buffer<u32, E> list_, pairs_;          // list_: this rank's rows, by the rank they went to
  buffer<detail::taken_unit, E> taken_;
  buffer<detail::returned_unit, E> returned_;
  std::vector<int> returned_views_;  // their views
  buffer<u64, E> told_;              // where each unit's rows end, and the costs of rows of tiles
};

}}  // namespace gart::GART_ISA
