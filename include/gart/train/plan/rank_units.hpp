#pragma once
/// \file
/// The plan of a step on several ranks, or of a batch of views. A step has rounds. In each round every rank traces a
/// unit (shard/work_units.hpp), ranks exchange rows, and gradients are summed. whole_view.hpp, the plan of one rank,
/// has the same members.

#include <gart/render/render_image.hpp>
#include <gart/shard/row_exchange.hpp>
#include <gart/shard/sharded_rows.hpp>
#include <gart/train/densify/densifier.hpp>
#include <gart/train/step_image.hpp>

#include <optional>
#include <utility>

namespace gart { inline namespace GART_ISA {

namespace train_kernels {

// Adds a view's gradients to the sum over a batch; `share` of the last view makes it the mean.
struct add_gradients_body {
  gaussians_view<float> sum, view;
  float share;
  GART_KERNEL void operator()(index_t row, index_t column) const {
    float& to = row_element(sum, row, column);
    to = (to + row_element(view, row, column)) * share;
  }
};

}  // namespace train_kernels

/// Comm: a communicator for E.
template <execution E, class Comm, class Traits, class Tracer, bool Ordered>
class rank_units {
 public:
  static constexpr int sh_degree = Traits::sh_degree;  ///< degree of the stored coefficients
  using exchange = row_exchange<E, Comm, Tracer::tile_size, sh_degree,
                                typename Traits::response>;  ///< exchange for the tracer's tiles

  /// `block`: Gaussians in one block of rows (comm/row_owners.hpp).
  rank_units(E& exec, Comm const& comm, index_t block)
      : exec_(&exec),
        comm_(comm),
        rows_(exec, comm, block),
        round_(exec, comm, block),
        filter_(exec),
        prepared_(exec),
        view_gradients_(exec, 0, sh_degree),
        unit_gradients_(exec, 0, sh_degree),
        moments_(exec) {}

  /// Most views of a round: each rank traces one, or several ranks share one.
  int views() const { return comm_.size(); }
  /// The rows of this rank, and which rank owns which.
  sharded_rows<E, Comm>& rows() { return rows_; }
  /// Drops the last step's gradients.
  void begin_step() { arrived_.reset(); }
  /// Begins a round (row_exchange::fetch).
  void fetch(gaussians_view<float const> const& scene, std::vector<camera> const& views,
             std::vector<std::size_t> const& names, render_options const& options) {
    round_.fetch(scene, views, names, options);
  }
  /// The unit that this rank traces.
  work_unit const& unit() const { return round_.unit(); }
  /// The Gaussians of the unit; their colours are there from finish_fetch on.
  gaussians_view<float const> scene() const { return round_.scene(); }
  void finish_fetch() { round_.finish_fetch(); }  ///< all ranks call it
  /// Joins strips of [H][W] of `bytes` a pixel to whole images.
  void share(void* image, camera const& view, std::size_t bytes) { round_.share_image(image, view, bytes); }

  /// Lets each rank differentiate the loss of its own strip, where nothing needs the whole image.
  bool divides_loss(bool may) { return divides_loss_ = may; }
  /// Differentiates the loss of this rank's strip. Other ranks send the rows that its windows reach, and get its sums
  /// of the loss while gradients are gathered.
  void differentiate_loss(step_image<E>& image, truth_view const& truth, camera const& seen, float ssim_weight,
                          bool errors) {
    using loss = image_loss<E>;
    auto const rows = [&](work_unit const& unit) { return rows_in(unit, seen.height); };
    round_.share_image(image.color.data(), seen, 3 * sizeof(float),
                       [&](work_unit const& unit) { return loss::reads(rows(unit), seen.height); });
    image_rows const mine = rows(unit());
    image.loss.differentiate(image.color, truth, seen.width, seen.height, ssim_weight, image.by_color, mine);
    if (errors) error_map(*exec_, image.color, truth, image.error, mine, seen.width);
    round_.begin_sharing({image.loss.sums(0), image.loss.sums(1)}, loss::sums_of({}, seen.height).end,
                         [&](work_unit const& unit) { return loss::sums_of(rows(unit), seen.height); });
  }
  /// The loss's value, when all work is queued.
  void finish_loss(step_image<E>& image, span<float> value) {
    if (divides_loss_) image.loss.total(value);
  }

  /// Throws where a pass would change the order of sums.
  template <class Pass>
  void require(Pass const& pass) const {
    if constexpr (Ordered && !Pass::ordered) throw pass.out_of_memory_error();
  }
  /// Sums gradients over this rank's unit.
  template <class Frame, class Pass>
  void sum(Frame& frame, Pass& pass, step_image<E> const& image, gaussians<E>&) {
    unit_gradients_.resize_keep(round_.scene().count);
    sum_gradients(frame, pass, image.gradients(), unit_gradients_.view(), image.error);
  }
  /// Sends the sums to the Gaussians' owners.
  template <class Frame, class Pass>
  void give_back(Frame& frame, Pass const& pass, float antialias) {
    if (round_.finishes())
      finish_gradients(*exec_, frame.scene(), frame.gaussians(), frame.view(), antialias, pass.moments(),
                       unit_gradients_.view());
    if constexpr (!Ordered || Pass::ordered) round_.give_back(pass, std::as_const(unit_gradients_).view());
  }
  void give_nothing_back() { round_.give_nothing_back(Ordered); }  ///< for a rank without a unit

  /// Turns the round's sums into gradients of this rank's rows. The round's first view is image number `image` of the
  /// step. own(v, gradients) gets the gradients by view v alone, with colours only if `by_view`. Colours are else added
  /// over all views at once, as is everything where neither densifier nor caller needs single views.
  template <class Own>
  void take(E& exec, trained_gaussians<E>& g, std::vector<camera> const& views, int image, int batch,
            render_options const& options, densifier<E>& densify, bool by_view, Own const& own) {
    index_t const n = g.size();
    int const count = static_cast<int>(views.size());
    auto const share_after = [&](int images) { return images == batch ? 1.0f / static_cast<float>(batch) : 1.0f; };
    bool const finishes = round_.finishes(), at_once = finishes && !by_view && !densify.by_gradient();
    gaussians<E>& gradients = g.gradients;
    if (!finishes) moments_.resize(std::size_t{moment_stride} * n), prepared_.resize(n);
    if (batch > 1 && !at_once) view_gradients_.resize_keep(n);
    bool const adds = image > 0;
    auto const scene = std::as_const(g.model).view();
    float* const errors = finishes && densify.by_error() ? densify.error_sums(n).data() : nullptr;
    if (at_once)
      round_.sum_finished(0, count, share_after(image + count), gradients.view(), errors, adds), image += count;
    for (int v = 0; v < count && !at_once; ++v, ++image) {
      camera const& view = views[static_cast<std::size_t>(v)];
      gaussians<E>& to = image == 0 ? gradients : view_gradients_;
      if (by_view) round_.sum_colors(v, v + 1, 1, to.sh.view(), false);
      if (finishes) {
        round_.sum_finished(v, v + 1, 1, to.view(), errors, false);
      } else {
        round_.sum_moments(v, moments_.view());
        auto const seen = filter_.of(exec, scene, view, options.antialias);
        parallel_for(exec, "preprocess", n,
                     render_kernels::prepare_gaussians<typename Traits::response>{seen, view.position,
                                                                                  options.alpha_min, prepared_.view()});
        finish_gradients(exec, scene, prepared_, view, options.antialias, moments_, to.view());
        if (densify.by_error() && n) add_errors(exec, moments_, densify.error_sums(n));
      }
      own(v, to);
      if (image > 0)
        for_each_column(exec, "batch/add", n, by_view ? row_width(sh_degree) : geometry_columns + 1,
                        train_kernels::add_gradients_body{gradients.view(), to.view(), share_after(image + 1)});
    }
    // Colours come last because they arrive last. On a device Adam takes the step's last ones from the received
    // buffers, which saves 8 bytes an element.
    if (by_view) return;
    if (E::device && image == batch)
      arrived_ = {count, share_after(image), adds};
    else
      round_.sum_colors(0, count, share_after(image), gradients.sh.view(), adds);
  }
  /// Adam's step; the last colours arrive meanwhile.
  void move(E& exec, adam_pass<E> const& adam, gaussians<E>& gradients) {
    if (!arrived_) return adam.all(exec);
    adam.geometry(exec);
    auto const [views, share, adds] = *arrived_;
    adam.colors(
        [&](auto const& take) { round_.take_colors(0, views, share, gradients.sh.view(), adds, "adam/colors", take); });
  }
  /// Writes the received colour gradients into gradients.sh, for callers that read it.
  void sum_arrived(gaussians<E>& gradients) {
    if (auto const arrived = std::exchange(arrived_, {}))
      round_.sum_colors(0, arrived->views, arrived->share, gradients.sh.view(), arrived->adds);
  }
  /// `changed`: the set of Gaussians has changed, so their gradients are invalid.
  void end_step(bool changed) {
    if (changed) arrived_.reset();
  }

  /// Gives all ranks the numbers that the first rank of each view found: a row of `width` a view. `first`: the row of
  /// the round's first view.
  void collect(std::vector<float>& rows, std::size_t width, int first) {
    auto const at = [&](int view) { return rows.data() + static_cast<std::size_t>(first + view) * width; };
    std::vector<float> all(width * static_cast<std::size_t>(comm_.size()));
    comm_.all_gather(at(unit().view), all.data(), width * sizeof(float));
    for (int rank = comm_.size(); rank-- > 0;)
      std::copy_n(all.data() + static_cast<std::size_t>(rank) * width, width,
                  at(round_.units()[static_cast<std::size_t>(rank)].view));
  }
  /// The sum over all ranks.
  u64 sum(u64 mine) {
    comm_.all_reduce(span<u64>(&mine, 1));
    return mine;
  }
  /// Renders a view by all ranks; each traces its rows of the image.
  template <class Frame>
  rendered render(Frame& frame, trained_gaussians<E>& g, camera const& view, render_options render, int degree) {
    sum_arrived(g.gradients);  // before the received buffers are overwritten
    round_.fetch(std::as_const(g.model).view(), {view}, {}, render);
    render.rows = unit().rows;
    bool const traces = !unit().empty();
    std::size_t const pixels = static_cast<std::size_t>(view.width) * view.height;
    buffer<float, E> color(*exec_, 3 * pixels), transmittance(*exec_, pixels), depth(*exec_, pixels);
    buffer<u32, E> hits(*exec_, pixels);
    if (traces) frame.prepare(round_.scene(), view, render, degree);
    round_.finish_fetch();
    if (traces) frame.render({color.data(), transmittance.data(), depth.data(), hits.data()});
    share(color.data(), view, 3 * sizeof(float)), share(transmittance.data(), view, sizeof(float));
    share(depth.data(), view, sizeof(float)), share(hits.data(), view, sizeof(u32));
    round_.take_traffic();
    return rendered_of(view, color, transmittance, depth, hits);
  }
  /// Bytes that this rank has sent to others since the last call.
  u64 take_traffic() { return round_.take_traffic(); }

 private:
  // Colour gradients that exist only in the received buffers (shard/row_exchange.hpp).
  struct arrived_colors {
    int views = 0;      // views of the step's last round
    float share = 1;    // factor, see row_exchange::sum_colors
    bool adds = false;  // to the gradients of earlier rounds
  };

  E* exec_;
  Comm comm_;
  sharded_rows<E, Comm> rows_;
  exchange round_;
  antialiased<E> filter_;             // of this rank's rows
  buffer<ray_gaussian, E> prepared_;  // this rank's rows in a view's frame
  gaussians<E> view_gradients_,       // this rank's rows, by one view of a batch
      unit_gradients_;                // this rank's sums over its unit: .sh, and for a whole view all parameters
  buffer<float, E> moments_;          // this rank's rows, by one view
  bool divides_loss_ = false;
  std::optional<arrived_colors> arrived_;  // the last step's, where Adam read the received buffers
};

}}  // namespace gart::GART_ISA
