#pragma once
/// \file
/// Sends the rows that a round of a step needs from their owners to the ranks that trace them (work_units.hpp), and the
/// sums of their gradients back.
///
///   row_exchange<E, Comm, 8, 3, response> rows(exec, comm, block);
///   rows.fetch(scene, views, names, options);  // `scene`: the rows of this rank
///   frame.prepare(rows.scene(), views[rows.unit().view], options with rows.unit().rows);
///   rows.finish_fetch();                     // work queued from here on has colours
///   ...                                      // the image, its gradient, sum_gradients
///   rows.give_back(pass, gradients);         // this rank's sums
///   rows.sum_moments(v, moments);            // one view's, for this rank's rows; sum_finished where it finishes()
///   rows.sum_colors(0, views, share, sh_gradient, false);  // colours arrive last; or take_colors
///
/// An owner finds the boxes of its rows in each view, and sends a row to the ranks whose tiles its box meets. Rows are
/// put in the order of the Gaussians' numbers, so images have the bits of a single rank. Colours and their gradients,
/// four fifths of the traffic, travel while lists are made and while owners finish the gradients of geometry. A rank
/// that traces a whole view finishes those itself, and sends them in place of moments. Sums are added in the order of
/// ranks. An `ordered` strategy also gets the bits of a single rank: pairs that began in an earlier strip travel one by
/// one, and the owner adds them to that strip's sum.
///
/// Traffic a row and unit: 4 (row width + 1) bytes out, up to a multiple of 16, and 4 (3 K + 12) back: 240 each at
/// degree 3. If ordered, as much again for each pair of a row that began in an earlier strip. Memory: 16 bytes for each
/// of this rank's rows and each view, 12 a row and unit, and the rows that travel. The host waits once, for the counts.
/// Errors: out_of_memory.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/backward/backward.hpp>
#include <gart/render/antialiased.hpp>
#include <gart/shard/arrival_order.hpp>
#include <gart/shard/image_strips.hpp>
#include <gart/shard/row_exchange_kernels.hpp>
#include <gart/shard/sharded_rows.hpp>
#include <gart/shard/view_costs.hpp>
#include <gart/shard/work_units.hpp>

namespace gart { inline namespace GART_ISA {

/// Size: side of a tile. Response: the Gaussians'.
template <execution E, class Comm, int Size, int ShDegree, class Response>
requires communicator<Comm, E>
class row_exchange {
 public:
  /// Holds no rows yet. `exec` must outlive it.
  row_exchange(E& exec, Comm comm, index_t block)
      : exec_(&exec),
        comm_(std::move(comm)),
        owners_{comm_.size(), comm_.rank(), block},
        filter_(exec),
        scene_(exec, 0, ShDegree),
        place_of_(exec),
        list_(exec),
        sent_pairs_(exec),
        taken_(exec),
        returned_(exec),
        order_(exec),
        counts_(exec),
        places_(exec),
        total_(exec, 1),
        told_(exec),
        out_(exec),
        in_(exec),
        colors_out_(exec),
        colors_in_(exec),
        pairs_out_(exec),
        pairs_in_(exec) {}

  /// Fetches the rows for the round's views, at most one a rank, without colours (finish_fetch). `names`: numbers to
  /// remember the views' costs by; may be empty.
  void fetch(gaussians_view<float const> scene, std::vector<camera> const& views, std::vector<std::size_t> const& names,
             render_options const& options) {
    stage_scope stage(*exec_, "exchange/rows");
    comm_.finish(*exec_);
    measure(scene, views, names, options);
    std::vector<u64> costs = select(scene.count);
    received_ = send_counts(costs);
    if (!costs.empty()) costs_.remember(names, costs_.by_view(views, costs));
    std::size_t const leave = total(sent_), arrive = total(received_);
    index_t const leaving = static_cast<index_t>(leave), arriving = static_cast<index_t>(arrive);
    out_.resize(leave * detail::placing_width), in_.resize(arrive * detail::placing_width);
    colors_out_.resize(leave * colors_width), colors_in_.resize(arrive * colors_width);
    scene_.resize_keep(arrive);
    for_each_column<detail::placing_width / 4>(
        *exec_, "exchange/pack", leaving,
        detail::pack_placing_body{scene, owners_, list_.data(),
                                  way<detail::placing_width>(sent_, out_.data(), received_, in_.data())});
    begin(messages(sent_, out_.data(), detail::placing_width), messages(received_, in_.data(), detail::placing_width));
    for_each_column<colors_width / 4>(
        *exec_, "exchange/pack", leaving,
        detail::pack_colors_body<coefficients>{
            scene.sh, list_.data(), way<colors_width>(sent_, colors_out_.data(), received_, colors_in_.data())});
    comm_.finish(*exec_);
    begin(messages(sent_, colors_out_.data(), colors_width), messages(received_, colors_in_.data(), colors_width));
    order_.find(in_.data(), arriving, scene.count, owners_, places_);
    for_each_column<detail::placing_width / 4>(*exec_, "exchange/unpack", arriving,
                                               detail::unpack_placing_body{scene_.view(), in_.data(), order_.data()});
  }
  /// Fetches their colours. Every rank calls it, with a unit to trace or without.
  void finish_fetch() {
    stage_scope stage(*exec_, "exchange/rows");
    comm_.finish(*exec_);
    for_each_column<colors_width / 4>(
        *exec_, "exchange/unpack", scene_.size(),
        detail::unpack_colors_body<coefficients>{scene_.sh.data(), colors_in_.data(), order_.data()});
  }

  /// The unit that this rank traces.
  work_unit const& unit() const { return units_[static_cast<std::size_t>(owners_.rank)]; }
  /// The units of all ranks.
  std::vector<work_unit> const& units() const { return units_; }
  /// The unit's rows, in the order of their numbers.
  gaussians_view<float const> scene() const { return scene_.view(); }
  /// Bytes that this rank has sent to others since the last call.
  u64 take_traffic() { return std::exchange(traffic_, u64{0}); }

  /// Joins strips of [H][W] of `bytes` a pixel to whole images, on all ranks that trace the same view.
  void share_image(void* image, camera const& view, std::size_t bytes) {
    share_image(image, view, bytes, [&](work_unit const&) { return image_rows{0, view.height}; });
  }
  /// The same for the rows that a unit reads.
  void share_image(void* image, camera const& view, std::size_t bytes, auto const& reads) {
    traffic_ += share_strips(*exec_, comm_, units_, image, view, bytes, reads);
  }
  /// Sends rows of `arrays`, in parallel with queued work until give_back, from the rank that `has` them to all ranks
  /// of the same view.
  void begin_sharing(std::initializer_list<span<float>> arrays, int rows, auto const& has) {
    traffic_ += begin_sharing_rows(*exec_, comm_, units_, arrays, rows, has);
  }

  /// Whether each rank traces a whole view and finishes its gradients; then use sum_finished, not sum_moments.
  bool finishes() const { return finishes_; }
  /// Sends the pass's sums over this rank's strip: gradients.sh, and for a whole view all gradients.
  template <class Pass>
  void give_back(Pass const& pass, gaussians_view<float const> gradients) {
    static_assert(!Pass::records || Pass::tile_size == Size);
    stage_scope stage(*exec_, "exchange/gradients");
    if constexpr (Pass::ordered) pack_pairs(pass);
    return_sums(Pass::ordered, pass.moments().data(), gradients);
  }
  /// The same for a rank that has traced nothing.
  void give_nothing_back(bool ordered) {
    stage_scope stage(*exec_, "exchange/gradients");
    pairs_out_.resize(0), pairs_leaving_.assign(units_.size(), 0);
    return_sums(ordered, nullptr, {});
  }

  /// Sums the colour gradients of this rank's rows, [rows][K][3], over the round's views [first, end), times `share`.
  /// If `adds`, existing values count too.
  void sum_colors(int first, int end, float share, span<float> sh_gradient, bool adds) {
    take_colors(first, end, share, sh_gradient, adds, "exchange/add",
                detail::keep_sums{sh_gradient.data(), coefficients});
  }
  /// The same, given to take(row, first, piece) for adam_pass::colors; until the next fetch.
  template <class Take>
  void take_colors(int first, int end, float share, span<float const> sh_gradient, bool adds, char const* label,
                   Take const& take) {
    comm_.finish(*exec_);
    add_sums<0, layout::coefficients>(label, first, end, colors_in_, share, sh_gradient, adds, take);
  }
  /// Sums their moments, [rows][moment_stride], over all pixels of the round's view v.
  void sum_moments(int v, span<float> moments) {
    add_sums<layout::coefficients, layout::moments>("exchange/add", v, v + 1, in_, 1, moments, false,
                                                    detail::keep_sums{moments.data(), moment_stride});
  }
  /// Sums their other gradients in the same way. Errors seen through the rows are added to `errors`, [rows] or null.
  void sum_finished(int first, int end, float share, gaussians_view<float> gradients, float* errors, bool adds) {
    stage_scope stage(*exec_, "exchange/gradients");
    auto const [units, count] = returned_of(first, end);
    for_each_column<moment_stride / 4>(
        *exec_, "exchange/add", gradients.count,
        detail::add_finished_body{units, count, in_.data(), gradients, errors, adds, share});
  }

 private:
  static constexpr index_t coefficients = 3 * sh_basis<ShDegree>::size, sums = coefficients + moment_stride,
                           colors_width = detail::colors_width(coefficients);
  using layout = detail::sums_layout<coefficients>;
  using piece = typename layout::piece;

  static u64 total(std::vector<u64> const& counts) { return std::accumulate(counts.begin(), counts.end(), u64{0}); }

  // Messages of rows of `width` floats, so many to or from each rank. Rows that stay here need none: they are written
  // where they would arrive.
  std::vector<message> messages(std::vector<u64> const& counts, void* data, std::size_t width) const {
    std::vector<message> all = messages_of(counts, data, width * sizeof(float));
    std::erase_if(all, [&](message const& m) { return m.rank == owners_.rank; });
    return all;
  }
  // The memory where rows are written before they leave.
  template <index_t Width, class T>
  detail::way_out<T, Width> way(std::vector<u64> const& leave, T* out, std::vector<u64> const& arrive, T* in) const {
    auto const me = static_cast<std::ptrdiff_t>(owners_.rank);
    auto const before = [&](std::vector<u64> const& counts) {
      return std::accumulate(counts.begin(), counts.begin() + me, u64{0});
    };
    return {out, in, before(leave), leave[static_cast<std::size_t>(me)], before(arrive)};
  }
  void begin(std::vector<message> const& sends, std::vector<message> const& receives) {
    for (message const& m : sends) traffic_ += m.rank == owners_.rank ? 0 : m.bytes;
    comm_.begin(*exec_, as_span(sends), as_span(receives));
  }

  // Finds the boxes of this rank's rows in each view, and the units of all ranks, from the views' costs at their last
  // trace, or now for a new view. Present costs come with the counts. A view that one rank traces alone needs no cost.
  void measure(gaussians_view<float const> scene, std::vector<camera> const& views,
               std::vector<std::size_t> const& names, render_options const& options) {
    bool const shared = views.size() < static_cast<std::size_t>(owners_.ranks);
    finishes_ = !shared;
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
  std::vector<u64> select(index_t rows) {
    std::size_t const units = units_.size(), all = rows * units;
    sent_.assign(units, 0), returned_views_.clear();
    place_of_.resize(all), places_.resize(all + 1);
    std::vector<detail::taken_unit> taken;
    for (work_unit const& u : units_) taken.push_back({boxes_[static_cast<std::size_t>(u.view)].data(), u.rows});
    taken_.assign(taken);
    index_t const count = static_cast<index_t>(units);
    if (rows) {
      parallel_for(*exec_, "exchange/select", rows,
                   detail::select_kernel{taken_.data(), count, rows, place_of_.data()});
      exclusive_scan(*exec_, span<u32 const>(place_of_), places_.view().subspan(0, all),
                     places_.view().subspan(all, 1));
      parallel_for(*exec_, "exchange/select", count + 1, detail::unit_ends_kernel{places_.data(), rows, told_.data()});
    }
    std::vector<u64> ends = told_.to_host();
    std::vector<u64> costs(ends.begin() + static_cast<std::ptrdiff_t>(units + 1), ends.end());
    ends.resize(units + 1);
    list_.resize(ends.back()), sent_pairs_.resize(ends.back());
    if (rows)
      parallel_for(*exec_, "exchange/list", rows,
                   detail::list_kernel<Size>{taken_.data(), count, rows, places_.data(), told_.data(), list_.data(),
                                             sent_pairs_.data(), place_of_.data()});
    std::vector<detail::returned_unit> returned;
    for (std::size_t r = 0; r < units; ++r) {
      if (units_[r].empty() || rows == 0) continue;
      returned.push_back({units_[r].view, ends[r], place_of_.data() + r * rows});
      returned_views_.push_back(units_[r].view);
      sent_[r] = ends[r + 1] - ends[r];
    }
    returned_.assign(returned);
    return costs;
  }

  // The first unit that traced the views [first, end), and how many did.
  std::pair<detail::returned_unit const*, index_t> returned_of(int first, int end) const {
    auto const begin = std::lower_bound(returned_views_.begin(), returned_views_.end(), first),
               past = std::lower_bound(begin, returned_views_.end(), end);
    return {returned_.data() + (begin - returned_views_.begin()), static_cast<index_t>(past - begin)};
  }
  // Sums one kind of values, Width pieces a row, which begin at From in pairs. `before`: values of all rows to add to.
  template <index_t From, index_t Width, class Take>
  void add_sums(char const* label, int first, int end, buffer<float, E> const& in, float share,
                span<float const> before, bool adds, Take const& take) {
    stage_scope stage(*exec_, "exchange/gradients");
    auto const [units, count] = returned_of(first, end);
    for_each_column<Width>(
        *exec_, label, static_cast<index_t>(before.size() / (Width * layout::lane)),
        detail::add_sums_body<coefficients, From, Width, Take>{
            units, count, layout::pieces(in.data()), ordered_ ? places_.data() : nullptr, sent_pairs_.data(),
            layout::pieces(pairs_in_.data()), adds ? layout::pieces(before.data()) : nullptr, share, take});
  }

  // Tells each rank how many rows come to it; `costs` become the sums over ranks.
  std::vector<u64> send_counts(std::vector<u64>& costs) {
    std::size_t const ranks = units_.size(), me = static_cast<std::size_t>(owners_.rank), width = ranks + costs.size();
    std::vector<u64> mine = sent_, all(ranks * width), counts(ranks);
    mine.insert(mine.end(), costs.begin(), costs.end());
    comm_.all_gather(mine.data(), all.data(), width * sizeof(u64));
    costs.assign(costs.size(), 0);
    for (std::size_t r = 0; r < ranks; ++r) {
      counts[r] = all[r * width + me];
      for (std::size_t k = 0; k < costs.size(); ++k) costs[k] += all[r * width + ranks + k];
    }
    return counts;
  }

  // The pairs of rows that began in an earlier strip, in the order in which the rows arrived.
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

  // Sends the sums of this rank's unit back, if it has traced one.
  void return_sums(bool ordered, float const* moments, gaussians_view<float const> gradients) {
    ordered_ = ordered;
    index_t const n = moments ? scene_.size() : 0;
    std::size_t const leave = total(received_), arrive = total(sent_);
    out_.resize(leave * moment_stride), in_.resize(arrive * moment_stride);
    colors_out_.resize(leave * coefficients), colors_in_.resize(arrive * coefficients);
    if (finishes_)
      for_each_column<moment_stride / 4>(
          *exec_, "exchange/pack", n,
          detail::pack_finished_body{gradients, moments, order_.data(),
                                     way<moment_stride>(received_, out_.data(), sent_, in_.data())});
    else
      pack_sums<layout::moments>(n, moments, out_, in_);
    std::vector<message> sends = messages(received_, out_.data(), moment_stride),
                         receives = messages(sent_, in_.data(), moment_stride);
    if (ordered) {
      std::vector<u64> const arriving = in_parts(span<u32 const>(sent_pairs_), sent_);
      pairs_in_.resize(total(arriving) * sums);
      for (message const& m : messages_of(pairs_leaving_, pairs_out_.data(), sums * sizeof(float))) sends.push_back(m);
      for (message const& m : messages_of(arriving, pairs_in_.data(), sums * sizeof(float))) receives.push_back(m);
    }
    begin(sends, receives);
    pack_sums<layout::coefficients>(n, gradients.sh, colors_out_, colors_in_);
    comm_.finish(*exec_);
    begin(messages(received_, colors_out_.data(), coefficients), messages(sent_, colors_in_.data(), coefficients));
  }

  template <index_t Width>
  void pack_sums(index_t n, float const* from, buffer<float, E>& out, buffer<float, E>& in) {
    for_each_column<Width>(*exec_, "exchange/pack", n,
                           detail::pack_sums_body<piece, Width>{
                               layout::pieces(from), order_.data(),
                               way<Width>(received_, layout::pieces(out.data()), sent_, layout::pieces(in.data()))});
  }

  E* exec_;
  Comm comm_;
  row_owners owners_;
  antialiased<E> filter_;
  gaussians<E> scene_;
  std::vector<buffer<footprint_slots, E>> boxes_;  // boxes of this rank's rows, by view
  std::vector<work_unit> units_;
  view_costs<Size> costs_;
  std::vector<u64> sent_, received_, pairs_leaving_;  // by rank
  buffer<u32, E> place_of_;                           // place of each row in each unit
  buffer<u32, E> list_, sent_pairs_;                  // list_: this rank's rows, by the rank they went to
  buffer<detail::taken_unit, E> taken_;
  buffer<detail::returned_unit, E> returned_;
  std::vector<int> returned_views_;  // their views
  arrival_order<E> order_;           // the arrival position of each row of scene_
  buffer<u32, E> counts_;
  buffer<u64, E> places_, total_;
  buffer<u64, E> told_;  // where each unit's rows end, and the costs of rows of tiles
  buffer<float, E> out_, in_, colors_out_, colors_in_, pairs_out_, pairs_in_;
  bool ordered_ = false, finishes_ = false;
  u64 traffic_ = 0;
};

}}  // namespace gart::GART_ISA
