#pragma once
/// \file
/// The rows that a round of a step needs, from their owners to who traces them (work_units.hpp), and the sums of their
/// gradients back.
///
///   row_exchange<E, Comm, 8, 3, response> rows(exec, comm, block);
///   rows.fetch(scene, views, options);       // `scene`: the rows of this rank
///   frame.prepare(rows.scene(), views[rows.unit().view], options of rows.unit().rows);
///   ...                                      // the image, its gradient, sum_gradients
///   rows.give_back(pass, sh_gradient);       // what this rank has summed
///   rows.sum_colors(0, views, share, sh_gradient, false);  // of the rows of this rank, over all that traced them
///   rows.sum_moments(v, moments);                          // for each view
///
/// An owner finds the boxes of its rows in each view, and sends a row to those whose tiles a box meets. What arrives is
/// put in the order of the Gaussians' numbers, so that lists, ties and images have the bits of one rank that has all.
/// Sums are added in the order of ranks. With sums in a fixed order (a strategy that is `ordered`) they also have the
/// bits of one rank: where a Gaussian's pairs begin in an earlier strip, the pairs travel one by one, and its owner
/// goes on adding where the earlier strip's sum ends.
///
/// Traffic a row and unit: 4 (row width + 1) bytes out, up to a multiple of 16, and 4 (3 K + 12) back: 240 both ways at
/// degree 3; ordered, as much again for each pair of a row that began above. Memory: 16 bytes a row of this rank's and
/// view, 4 a row and unit, these buffers, and the rows that arrived. Errors: out_of_memory.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/algorithm/sort_pairs.hpp>
#include <gart/backward/backward.hpp>
#include <gart/render/antialiased.hpp>
#include <gart/shard/row_exchange_kernels.hpp>
#include <gart/shard/sharded_rows.hpp>
#include <gart/shard/work_units.hpp>

#include <bit>

namespace gart::inline GART_ISA {

/// Size: side of a tile. Response: of the Gaussians.
template <execution E, class Comm, int Size, int ShDegree, class Response>
requires communicator<Comm, E>
class row_exchange {
 public:
  /// No row is here yet. `exec` must outlive it.
  row_exchange(E& exec, Comm comm, index_t block)
      : exec_(&exec),
        comm_(std::move(comm)),
        owners_{comm_.size(), comm_.rank(), block},
        filter_(exec),
        scene_(exec, 0, ShDegree),
        cost_(exec),
        flags_(exec),
        list_(exec),
        sent_pairs_(exec),
        place_of_(exec),
        returned_(exec),
        ids_(exec),
        order_(exec),
        counts_(exec),
        places_(exec),
        total_(exec, 1),
        out_(exec),
        in_(exec),
        pairs_out_(exec),
        pairs_in_(exec) {}

  /// The rows of the round's views, at most one a rank; the same on all ranks.
  void fetch(gaussians_view<float const> scene, std::vector<camera> const& views, render_options const& options) {
    stage_scope stage(*exec_, "exchange/rows");
    measure(scene, views, options);
    select(scene.count);
    std::vector<u64> const received = send_counts();
    index_t const own = row_width(ShDegree), width = detail::travelling_width(own);
    std::size_t const leave = sent_.total(), arrive = std::accumulate(received.begin(), received.end(), std::size_t{0});
    received_ = received;
    out_.resize(leave * width), in_.resize(arrive * width);
    for_each_column(*exec_, "exchange/pack", static_cast<index_t>(leave), width / 4,
                    detail::pack_body{scene, owners_, list_.data(), out_.data(), own, width});
    traffic_ += width * sizeof(float) * (leave - sent_.counts[static_cast<std::size_t>(owners_.rank)]);
    comm_.exchange(*exec_, as_span(messages_of(sent_.counts, out_.data(), width * sizeof(float))),
                   as_span(messages_of(received, in_.data(), width * sizeof(float))));
    ids_.resize(arrive), order_.resize(arrive), scene_.resize_keep(arrive);
    index_t const n = static_cast<index_t>(arrive);
    parallel_for(*exec_, "exchange/ids", n, detail::ids_kernel{in_.data(), width, ids_.data(), order_.data()});
    if (owners_.ranks > 1) sort_pairs(*exec_, ids_.view(), order_.view(), bits_of_ids(scene.count));
    for_each_column(*exec_, "exchange/unpack", n, width / 4,
                    detail::unpack_body{scene_.view(), in_.data(), own, width, order_.data()});
  }

  /// What this rank traces.
  work_unit const& unit() const { return units_[static_cast<std::size_t>(owners_.rank)]; }
  /// What each does.
  std::vector<work_unit> const& units() const { return units_; }
  /// The rows for it, in the order of their numbers.
  gaussians_view<float const> scene() const { return scene_.view(); }
  /// Bytes that this rank has sent to others since the last call.
  u64 take_traffic() { return std::exchange(traffic_, u64{0}); }

  /// Strips of [H][W] of `bytes` a pixel become whole images, on all ranks that trace the same view.
  void share_image(void* image, camera const& view, std::size_t bytes) {
    std::vector<message> sends, receives;
    auto const part = [&](work_unit const& u, int rank) {
      std::size_t const end = static_cast<std::size_t>(std::min(u.rows.end, view.height)),
                        first = static_cast<std::size_t>(u.rows.first);
      std::size_t const row = static_cast<std::size_t>(view.width) * bytes;
      return message{rank, static_cast<char*>(image) + first * row, u.empty() ? 0 : (end - first) * row};
    };
    for (int r = 0; r < owners_.ranks; ++r) {
      if (r == owners_.rank || units_[static_cast<std::size_t>(r)].view != unit().view) continue;
      if (message const m = part(unit(), r); m.bytes) sends.push_back(m), traffic_ += m.bytes;
      if (message const m = part(units_[static_cast<std::size_t>(r)], r); m.bytes) receives.push_back(m);
    }
    comm_.exchange(*exec_, as_span(sends), as_span(receives));
  }

  /// What the pass has summed over this rank's strip; sh_gradient is [rows][K][3].
  template <class Pass>
  void give_back(Pass const& pass, float const* sh_gradient) {
    static_assert(!Pass::records || Pass::tile_size == Size);
    stage_scope stage(*exec_, "exchange/gradients");
    index_t const n = scene_.size();
    out_.resize(std::size_t{n} * sums);
    for_each_column(
        *exec_, "exchange/pack", n, layout::width,
        detail::pack_sums_body<coefficients>{layout::pieces(sh_gradient), layout::pieces(pass.moments().data()),
                                             order_.data(), layout::pieces(out_.data())});
    if constexpr (Pass::ordered) pack_pairs(pass);
    return_sums(Pass::ordered);
  }
  /// The same of a rank that has traced nothing.
  void give_nothing_back(bool ordered) {
    out_.resize(0), pairs_out_.resize(0), pairs_leaving_.assign(static_cast<std::size_t>(owners_.ranks), 0);
    return_sums(ordered);
  }

  /// Of this rank's rows the colours' gradients, [rows][K][3]: the sum over the views [first, end) of the round, and
  /// of what is there if it `adds`, times `share`.
  void sum_colors(int first, int end, float share, span<float> sh_gradient, bool adds) {
    add_sums(first, end, 0, layout::coefficients, share, sh_gradient, adds);
  }
  /// Their moments, [rows][moment_stride], over all pixels of the round's view v.
  void sum_moments(int v, span<float> moments) {
    add_sums(v, v + 1, layout::coefficients, layout::moments, 1, moments, false);
  }

 private:
  static constexpr index_t coefficients = 3 * sh_basis<ShDegree>::size, sums = coefficients + moment_stride;
  using layout = detail::sums_layout<coefficients>;

  // What goes to each rank: its part of list_.
  struct parts {
    std::vector<u64> counts;
    u64 total() const { return std::accumulate(counts.begin(), counts.end(), u64{0}); }
  };

  // The boxes of this rank's rows in each view, and from all ranks' who traces what. A view that one rank traces alone
  // needs no cost.
  void measure(gaussians_view<float const> scene, std::vector<camera> const& views, render_options const& options) {
    bool const shared = views.size() < static_cast<std::size_t>(owners_.ranks);
    constexpr index_t counted = 1 << 16;  // rows of a rank, about, that tell the cost of a view's strips
    index_t const every = shared ? 1 + scene.count / counted : 0;
    std::vector<std::vector<u64>> costs;
    while (boxes_.size() < views.size()) boxes_.emplace_back(*exec_);
    for (std::size_t v = 0; v < views.size(); ++v) {
      tile_grid<Size> const grid{views[v].width, views[v].height};
      boxes_[v].resize(scene.count), cost_.resize(grid.rows() + 1);
      if (shared) cost_.zero();
      auto const seen = filter_.of(*exec_, scene, views[v], options.antialias);
      visit_camera(views[v], [&](auto const& model) {
        auto const bounds = model.bounds(options.near);
        parallel_for(*exec_, "exchange/boxes", scene.count,
                     detail::box_kernel<Response, E, Size, std::remove_const_t<decltype(bounds)>>{
                         seen, bounds, model.position, options.alpha_min, boxes_[v].data(), cost_.data(), every});
      });
      costs.push_back(shared ? cost_.to_host() : std::vector<u64>(grid.rows() + 1));
    }
    if (shared) add_costs(costs);
    for (std::vector<u64>& cost : costs) {
      std::inclusive_scan(cost.begin(), cost.end(), cost.begin());
      cost.pop_back();
    }
    units_ = divide_work(costs, owners_.ranks, Size);
  }

  // Over all ranks.
  void add_costs(std::vector<std::vector<u64>>& costs) {
    std::vector<u64> all;
    for (auto const& cost : costs) all.insert(all.end(), cost.begin(), cost.end());
    comm_.all_reduce(span<u64>(all.data(), all.size()));
    auto at = all.begin();
    for (auto& cost : costs) {
      auto const end = at + static_cast<std::ptrdiff_t>(cost.size());
      cost.assign(at, end), at = end;
    }
  }

  // Which rows go to whom.
  void select(index_t rows) {
    sent_.counts.assign(units_.size(), 0);
    flags_.resize(rows), places_.resize(rows), place_of_.resize(rows * units_.size());
    list_.resize(0), sent_pairs_.resize(0);
    std::vector<detail::returned_unit> returned;
    u64 at = 0;
    for (std::size_t r = 0; r < units_.size(); ++r) {
      work_unit const& u = units_[r];
      if (u.empty() || rows == 0) continue;
      u32* const place_of = place_of_.data() + r * rows;
      auto const& boxes = boxes_[static_cast<std::size_t>(u.view)];
      parallel_for(*exec_, "exchange/select", rows, detail::select_kernel{boxes.data(), u.rows, flags_.data()});
      exclusive_scan(*exec_, span<u32 const>(flags_), places_.view(), total_.view());
      u64 const count = total_.front();
      list_.resize_keep(at + count), sent_pairs_.resize_keep(at + count);
      parallel_for(*exec_, "exchange/list", rows,
                   detail::list_kernel<Size>{boxes.data(), u.rows, flags_.data(), places_.data(), list_.data() + at,
                                             sent_pairs_.data() + at, place_of});
      returned.push_back({u.view, at, place_of});
      sent_.counts[r] = count, at += count;
    }
    returned_views_.clear();
    for (detail::returned_unit const& u : returned) returned_views_.push_back(u.view);
    returned_.assign(returned);
  }

  // Bits of a Gaussian's number, where this rank has so many rows: others have at most a block more.
  int bits_of_ids(index_t rows) const {
    u64 const blocks = (u64{rows} + owners_.block - 1) / owners_.block + 1;
    return std::min(32, static_cast<int>(std::bit_width(blocks * owners_.block * static_cast<u64>(owners_.ranks) - 1)));
  }

  // Pieces [from, from + width) of what has come back.
  void add_sums(int first, int end, index_t from, index_t width, float share, span<float> out, bool adds) {
    stage_scope stage(*exec_, "exchange/gradients");
    auto const begin = std::lower_bound(returned_views_.begin(), returned_views_.end(), first),
               past = std::lower_bound(begin, returned_views_.end(), end);
    for_each_column(*exec_, "exchange/add", static_cast<index_t>(out.size() / (width * layout::lane)), width,
                    detail::add_sums_body<coefficients>{
                        returned_.data() + (begin - returned_views_.begin()), static_cast<index_t>(past - begin), from,
                        width, layout::pieces(in_.data()), ordered_ ? places_.data() : nullptr, sent_pairs_.data(),
                        layout::pieces(pairs_in_.data()), layout::pieces(out.data()), adds, share});
  }

  // What each rank has for this one.
  std::vector<u64> send_counts() {
    std::size_t const ranks = units_.size(), me = static_cast<std::size_t>(owners_.rank);
    std::vector<u64> all(ranks * ranks), mine(ranks);
    comm_.all_gather(sent_.counts.data(), all.data(), ranks * sizeof(u64));
    for (std::size_t r = 0; r < ranks; ++r) mine[r] = all[r * ranks + me];
    return mine;
  }

  // The pairs of rows that began in a strip above, in the order in which the rows came.
  template <class Pass>
  void pack_pairs(Pass const& pass) {
    index_t const n = scene_.size();
    counts_.resize(n), places_.resize(n);
    parallel_for(*exec_, "exchange/pairs", n,
                 detail::count_pairs_kernel<Size>{pass.ranges().data(), unit().rows, order_.data(), counts_.data()});
    pairs_leaving_ = in_parts(span<u32 const>(counts_), received_);
    u64 const pairs = std::accumulate(pairs_leaving_.begin(), pairs_leaving_.end(), u64{0});
    pairs_out_.resize(pairs * sums);
    for_each_column(
        *exec_, "exchange/pairs", n, sums,
        detail::pack_pairs_body<ShDegree>{pass.pair_offsets().data(), pass.pair_rows().data(), order_.data(),
                                          counts_.data(), places_.data(), pairs_out_.data()});
  }

  // Prefix sums of `counts` into places_, and the sums over parts of them.
  std::vector<u64> in_parts(span<u32 const> counts, std::vector<u64> const& cuts) {
    places_.resize(counts.size());
    std::vector<u64> out(cuts.size()), ends(cuts.size() + 1);
    if (counts.size() == 0) return out;
    exclusive_scan(*exec_, counts, places_.view(), total_.view());
    u64 at = 0;
    for (std::size_t r = 0; r < cuts.size(); at += cuts[r++])
      if (at < counts.size())
        exec_->copy_out(&ends[r], places_.data() + at, sizeof(u64));
      else
        ends[r] = total_.front();
    ends.back() = total_.front();
    for (std::size_t r = 0; r < cuts.size(); ++r) out[r] = ends[r + 1] - ends[r];
    return out;
  }

  // The way back of what came.
  void return_sums(bool ordered) {
    ordered_ = ordered;
    in_.resize(sent_.total() * sums);
    std::vector<message> sends = messages_of(received_, out_.data(), sums * sizeof(float)),
                         receives = messages_of(sent_.counts, in_.data(), sums * sizeof(float));
    if (ordered) {
      std::vector<u64> const arriving = in_parts(span<u32 const>(sent_pairs_).subspan(0, sent_.total()), sent_.counts);
      pairs_in_.resize(std::accumulate(arriving.begin(), arriving.end(), u64{0}) * sums);
      for (message const& m : messages_of(pairs_leaving_, pairs_out_.data(), sums * sizeof(float))) sends.push_back(m);
      for (message const& m : messages_of(arriving, pairs_in_.data(), sums * sizeof(float))) receives.push_back(m);
    }
    for (message const& m : sends) traffic_ += m.rank == owners_.rank ? 0 : m.bytes;
    comm_.exchange(*exec_, as_span(sends), as_span(receives));
  }

  E* exec_;
  Comm comm_;
  row_owners owners_;
  antialiased<E> filter_;
  gaussians<E> scene_;
  std::vector<buffer<footprint_slots, E>> boxes_;  // of this rank's rows, by view
  std::vector<work_unit> units_;
  parts sent_;
  std::vector<u64> received_, pairs_leaving_;
  buffer<u64, E> cost_;
  buffer<u32, E> flags_, list_, sent_pairs_;  // list_: rows of this rank's, by who they went to
  buffer<u32, E> place_of_;                   // of each row in each unit
  buffer<detail::returned_unit, E> returned_;
  std::vector<int> returned_views_;      // their views
  buffer<u32, E> ids_, order_, counts_;  // order_: where each row of scene_ lay in what came
  buffer<u64, E> places_, total_;
  buffer<float, E> out_, in_, pairs_out_, pairs_in_;
  bool ordered_ = false;
  u64 traffic_ = 0;
};

}  // namespace gart::inline GART_ISA
