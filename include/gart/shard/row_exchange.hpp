#pragma once
/// \file
/// Sends the rows that a round of a step needs from their owners to the ranks that trace them (work_units.hpp). Sums of
/// gradients go back.
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
/// row_selection.hpp finds which rows go to which rank, row_messages.hpp sends them. Rows are put in the order of the
/// Gaussians' numbers, so images have the bits of a single rank. Colours and their gradients are four fifths of the
/// traffic. They travel while lists are made and while owners finish gradients of geometry. A rank that traces a whole
/// view finishes those itself, and sends them in place of moments. Sums are added in the order of ranks. An `ordered`
/// method also gets the bits of a single rank. Pairs that began in an earlier strip travel one by one, and the owner
/// adds them to that strip's sum.
///
/// Traffic a row and unit: 4 (row width + 1) bytes out, up to a multiple of 16, and 4 (3 K + 12) back: 240 each at
/// degree 3. If ordered, as much again for each pair of a row that began in an earlier strip. Memory: the selection's,
/// and the rows that travel. Errors: out_of_memory.

#include <gart/algorithm/exclusive_scan.hpp>
#include <gart/backward/backward.hpp>
#include <gart/shard/arrival_order.hpp>
#include <gart/shard/image_strips.hpp>
#include <gart/shard/row_messages.hpp>
#include <gart/shard/row_selection.hpp>

#include <numeric>
#include <vector>

namespace gart { inline namespace GART_ISA {

/// Size: side of a tile. Response: the Gaussians'.
template <execution E, class Comm, int Size, int ShDegree, class Response>
requires communicator<Comm, E>
class row_exchange {
 public:
  /// Holds no rows yet. `exec` must outlive it.
  row_exchange(E& exec, Comm comm, index_t block)
      : exec_(&exec),
        messages_(exec, comm),
        owners_{comm.size(), comm.rank(), block},
        selected_(exec, std::move(comm), owners_),
        scene_(exec, 0, ShDegree),
        order_(exec),
        counts_(exec),
        places_(exec),
        total_(exec, 1),
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
    messages_.finish();
    selected_.find(scene, views, names, options, places_);
    std::vector<u64> const &leaving_of = selected_.leaving(), &arriving_of = selected_.arriving();
    std::size_t const leave = total(leaving_of), arrive = total(arriving_of);
    index_t const leaving = static_cast<index_t>(leave), arriving = static_cast<index_t>(arrive);
    out_.resize(leave * detail::placing_width), in_.resize(arrive * detail::placing_width);
    colors_out_.resize(leave * colors_width), colors_in_.resize(arrive * colors_width);
    scene_.resize_keep(arrive);
    for_each_column<detail::placing_width / 4>(
        *exec_, "exchange/pack", leaving,
        detail::pack_placing_body{
            scene, owners_, selected_.rows(),
            messages_.template way<detail::placing_width>(leaving_of, out_.data(), arriving_of, in_.data())});
    messages_.begin(messages_.rows(leaving_of, out_.data(), detail::placing_width),
                    messages_.rows(arriving_of, in_.data(), detail::placing_width));
    for_each_column<colors_width / 4>(
        *exec_, "exchange/pack", leaving,
        detail::pack_colors_body<coefficients>{
            scene.sh, selected_.rows(),
            messages_.template way<colors_width>(leaving_of, colors_out_.data(), arriving_of, colors_in_.data())});
    messages_.finish();
    messages_.begin(messages_.rows(leaving_of, colors_out_.data(), colors_width),
                    messages_.rows(arriving_of, colors_in_.data(), colors_width));
    order_.find(in_.data(), arriving, scene.count, owners_, places_);
    for_each_column<detail::placing_width / 4>(*exec_, "exchange/unpack", arriving,
                                               detail::unpack_placing_body{scene_.view(), in_.data(), order_.data()});
  }
  /// Fetches their colours. Every rank calls it, with a unit to trace or without.
  void finish_fetch() {
    stage_scope stage(*exec_, "exchange/rows");
    messages_.finish();
    for_each_column<colors_width / 4>(
        *exec_, "exchange/unpack", scene_.size(),
        detail::unpack_colors_body<coefficients>{scene_.sh.data(), colors_in_.data(), order_.data()});
  }

  /// The unit that this rank traces.
  work_unit const& unit() const { return units()[static_cast<std::size_t>(owners_.rank)]; }
  /// The units of all ranks.
  std::vector<work_unit> const& units() const { return selected_.units(); }
  /// The unit's rows, in the order of their numbers.
  gaussians_view<float const> scene() const { return scene_.view(); }
  /// Bytes that this rank has sent to others since the last call.
  u64 take_traffic() { return messages_.take_traffic(); }

  /// Joins strips of [H][W] of `bytes` a pixel to whole images, on all ranks that trace the same view.
  void share_image(void* image, camera const& view, std::size_t bytes) {
    share_image(image, view, bytes, [&](work_unit const&) { return image_rows{0, view.height}; });
  }
  /// The same for the rows that a unit reads.
  void share_image(void* image, camera const& view, std::size_t bytes, auto const& reads) {
    messages_.add_traffic(share_strips(*exec_, messages_.comm(), units(), image, view, bytes, reads));
  }
  /// Sends rows of `arrays` from the rank that `has` them to all ranks of the same view. It runs in parallel with
  /// queued work until give_back.
  void begin_sharing(std::initializer_list<span<float>> arrays, int rows, auto const& has) {
    messages_.add_traffic(begin_sharing_rows(*exec_, messages_.comm(), units(), arrays, rows, has));
  }

  /// Whether each rank traces a whole view and finishes its gradients; then use sum_finished, not sum_moments.
  bool finishes() const { return selected_.whole_views(); }
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
    pairs_out_.resize(0), pairs_leaving_.assign(units().size(), 0);
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
    messages_.finish();
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
    auto const [units, count] = selected_.returned(first, end);
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

  // Sums one kind of values, Width pieces a row, which begin at From in pairs. `before`: values of all rows to add to.
  template <index_t From, index_t Width, class Take>
  void add_sums(char const* label, int first, int end, buffer<float, E> const& in, float share,
                span<float const> before, bool adds, Take const& take) {
    stage_scope stage(*exec_, "exchange/gradients");
    auto const [units, count] = selected_.returned(first, end);
    for_each_column<Width>(
        *exec_, label, static_cast<index_t>(before.size() / (Width * layout::lane)),
        detail::add_sums_body<coefficients, From, Width, Take>{
            units, count, layout::pieces(in.data()), ordered_ ? places_.data() : nullptr, selected_.pairs().data(),
            layout::pieces(pairs_in_.data()), adds ? layout::pieces(before.data()) : nullptr, share, take});
  }

  // The pairs of rows that began in an earlier strip, in the order in which the rows arrived.
  template <class Pass>
  void pack_pairs(Pass const& pass) {
    index_t const n = scene_.size();
    counts_.resize(n), places_.resize(n);
    parallel_for(*exec_, "exchange/pairs", n,
                 detail::count_pairs_kernel<Size>{pass.ranges().data(), unit().rows, order_.data(), counts_.data()});
    pairs_leaving_ = in_parts(span<u32 const>(counts_), selected_.arriving());
    pairs_out_.resize(total(pairs_leaving_) * sums);
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
    std::vector<u64> const &leaving_to = selected_.arriving(), &arriving_from = selected_.leaving();
    std::size_t const leave = total(leaving_to), arrive = total(arriving_from);
    out_.resize(leave * moment_stride), in_.resize(arrive * moment_stride);
    colors_out_.resize(leave * coefficients), colors_in_.resize(arrive * coefficients);
    if (finishes())
      for_each_column<moment_stride / 4>(
          *exec_, "exchange/pack", n,
          detail::pack_finished_body{
              gradients, moments, order_.data(),
              messages_.template way<moment_stride>(leaving_to, out_.data(), arriving_from, in_.data())});
    else
      pack_sums<layout::moments>(n, moments, out_, in_);
    std::vector<message> sends = messages_.rows(leaving_to, out_.data(), moment_stride),
                         receives = messages_.rows(arriving_from, in_.data(), moment_stride);
    if (ordered) {
      std::vector<u64> const arriving = in_parts(selected_.pairs(), arriving_from);
      pairs_in_.resize(total(arriving) * sums);
      for (message const& m : messages_of(pairs_leaving_, pairs_out_.data(), sums * sizeof(float))) sends.push_back(m);
      for (message const& m : messages_of(arriving, pairs_in_.data(), sums * sizeof(float))) receives.push_back(m);
    }
    messages_.begin(sends, receives);
    pack_sums<layout::coefficients>(n, gradients.sh, colors_out_, colors_in_);
    messages_.finish();
    messages_.begin(messages_.rows(leaving_to, colors_out_.data(), coefficients),
                    messages_.rows(arriving_from, colors_in_.data(), coefficients));
  }

  template <index_t Width>
  void pack_sums(index_t n, float const* from, buffer<float, E>& out, buffer<float, E>& in) {
    for_each_column<Width>(*exec_, "exchange/pack", n,
                           detail::pack_sums_body<piece, Width>{
                               layout::pieces(from), order_.data(),
                               messages_.template way<Width>(selected_.arriving(), layout::pieces(out.data()),
                                                             selected_.leaving(), layout::pieces(in.data()))});
  }

  E* exec_;
  row_messages<E, Comm> messages_;
  row_owners owners_;
  row_selection<E, Comm, Size, Response> selected_;
  gaussians<E> scene_;
  std::vector<u64> pairs_leaving_;  // by rank
  arrival_order<E> order_;          // the arrival position of each row of scene_
  buffer<u32, E> counts_;
  buffer<u64, E> places_, total_;
  buffer<float, E> out_, in_, colors_out_, colors_in_, pairs_out_, pairs_in_;
  bool ordered_ = false;
};

}}  // namespace gart::GART_ISA
